#pragma once
/// The flights of a pack as they are estimated.

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include "kernels.hpp"
#include "lane.hpp"
#include "trihedron/core/jitter.hpp"
#include "trihedron/core/outlier_gate.hpp"

namespace trihedron::lanes {

/// The readings of a sample.
struct Kept {
  V3 h_b[kGyros];
};

/// The readings of samples, counted from that of a fix.
struct SamplesAround {
  const Kept* of_fix;
  int first;
  int last;
  Duration period;

  [[nodiscard]] const V3* at(int sample) const { return of_fix[sample].h_b; }
};

/// The filters of all lanes.
class Filters {
 public:
  Filters(std::span<Lane* const> lanes, const Kernels& kernels);

  void predict(const V3 (&h_b)[kGyros], double dt_s);
  /// The fixes of a time, with the readings around it.
  void fix(Time t, const Fit& fit, const SamplesAround& samples, const M3& truth);
  /// What has to be flown alone since the pass ends so.
  void end(Time t);
  [[nodiscard]] bool have_all_left() const;

  /// Of a lane; nothing where it has to be flown alone.
  [[nodiscard]] std::optional<FilterResult> result(std::size_t i) const;

 private:
  /// A flight on its way.
  struct State {
    bool has_left = false;  ///< it is to be flown alone
    bool has_started = false;
    std::size_t next_fix = 0;
    Time used_t{};
    OutlierGate gate;
    Jitter jitter;
    FilterResult result;
  };

  [[nodiscard]] static bool take_fix(const Lane& lane, State& its, Time t, StarFix& fix);
  [[nodiscard]] bool uses_both_readings(std::size_t i, Time t, const SamplesAround& samples) const;
  void start(std::size_t i, const StarFix& fix, const Fix& all);
  void load(std::size_t i, const Fix& all);
  void leave_by_time_or_geometry(std::size_t i, Time t);
  void judge(std::size_t i, Time t, Fix& fix);
  void leave_by_drift();

  std::span<Lane* const> lanes_;
  const Kernels& kernels_;
  Duration reach_;
  std::unique_ptr<Filter> filter_ = std::make_unique<Filter>();
  std::unique_ptr<Filter> before_ = std::make_unique<Filter>();
  std::unique_ptr<Fix> fix_ = std::make_unique<Fix>();
  Errors errors_{};
  std::array<State, kWidth> states_;
};

}  // namespace trihedron::lanes
