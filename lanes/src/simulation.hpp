#pragma once
/// The flights of a pack as they are.

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "kernels.hpp"
#include "lane.hpp"

namespace trihedron::lanes {

/// The true attitude and momenta of all lanes, and what the gyros read of them.
class Simulation {
 public:
  Simulation(std::span<Lane* const> lanes, const Kernels& kernels);

  /// The readings of the next sample.
  void next(V3 (&h_b)[kGyros]);
  /// At the sample that next() gave last.
  [[nodiscard]] const M3& C_in_c() const { return end_; }

 private:
  [[nodiscard]] Lane& lane(std::size_t i) const { return *lanes_[std::min(i, lanes_.size() - 1)]; }
  void put_reference();
  void put_jitter();
  void put_gyros();
  void turn_begins(std::size_t i, const sim::SlewPlan::Turn& turn);
  void look_for_turns(double t_s);
  void attitude_at(double t_s, M3& C_in_c);
  void make_noise();

  static constexpr std::size_t kNoiseTogether = 32;  ///< samples

  std::span<Lane* const> lanes_;
  const Kernels& kernels_;
  Duration period_;
  Duration since_{};
  bool has_begun_ = false;
  std::vector<SplineNode> nodes_;
  std::vector<V3> jitter_;
  Attitude attitude_{};
  TrueGyro gyros_[kGyros]{};
  M3 end_{};
  std::array<std::vector<InCircle>, kGyros> points_;
  std::array<std::vector<V3>, kGyros> noise_;
  std::size_t noise_used_ = kNoiseTogether;
  std::array<std::size_t, kWidth> turns_begun_{};
  double next_turn_s_ = -std::numeric_limits<double>::infinity();
};

}  // namespace trihedron::lanes
