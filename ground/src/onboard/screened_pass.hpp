#pragma once
/// The usable samples and fixes of a pass, as screened by the on-board step.

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "trihedron/core/step_report.hpp"
#include "trihedron/core/telemetry.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// What takes the place of directions that are not there.
[[nodiscard]] inline Directions unread() {
  Directions h_b;
  std::ranges::fill(h_b, Eigen::Vector3d::UnitX());
  return h_b;
}

/// Some samples of a telemetry, in the order of their times, and which gyros can be used at each. Only their places are
/// kept: the telemetry of a pass is long, and must outlive this.
class ScreenedSamples {
 public:
  struct Sample {
    Time t{};
    Directions h_b = unread();  ///< unit, where used
    GyroMask used{};
  };

  ScreenedSamples() = default;
  explicit ScreenedSamples(const GyroTelemetry& telemetry) : telemetry_(&telemetry) {}

  void add(std::size_t place, const GyroMask& used) { kept_.push_back({static_cast<std::uint32_t>(place), used}); }
  void clear() { kept_.clear(); }

  [[nodiscard]] std::size_t size() const { return kept_.size(); }
  [[nodiscard]] Time t(std::size_t i) const { return telemetry_->t[kept_[i].place]; }
  [[nodiscard]] const GyroMask& used(std::size_t i) const { return kept_[i].used; }
  [[nodiscard]] Directions h_b(std::size_t i) const {
    Directions h_b = unread();
    for (int k = 0; k < std::min(telemetry_->gyros, kMaxGyros); ++k) {
      h_b[k] = telemetry_->direction(kept_[i].place, k).normalized();
    }
    return h_b;
  }
  [[nodiscard]] Sample operator[](std::size_t i) const { return {t(i), h_b(i), used(i)}; }

  /// The first sample not before `t`, or size().
  [[nodiscard]] std::size_t from(Time t) const {
    const auto found =
        std::ranges::lower_bound(kept_, t, {}, [this](const Kept& kept) { return telemetry_->t[kept.place]; });
    return static_cast<std::size_t>(found - kept_.begin());
  }

 private:
  struct Kept {
    std::uint32_t place = 0;
    GyroMask used{};
  };

  const GyroTelemetry* telemetry_ = nullptr;
  std::vector<Kept> kept_;
};

/// In the order of their times; where the clock was set back, the stretch with the most fixes.
struct ScreenedPass {
  ScreenedPass() = default;
  /// The telemetry must outlive it.
  ScreenedPass(const GyroTelemetry& telemetry, int used_gyros)
      : gyros(used_gyros), samples(telemetry), longest_samples(telemetry) {}
  struct Fix {
    StarFix fix;
    Directions h_b = unread();  ///< fitted through several samples
    GyroMask used{};
    double noise_factor = 1;                ///< as of FixReadings
    float jitter_rad2 = 0;                  ///< same
    Eigen::Vector3d rate_c{0, 0, 0};        ///< of the body relative to `in`, rad/s
    Duration since_last = Duration::max();  ///< fix of the same star tracker
  };

  int gyros = 0;
  ScreenedSamples samples;
  std::vector<Fix> fixes;  ///< used or rejected as outliers; all star trackers
  bool clock_set_back = false;
  ScreenedSamples longest_samples;  ///< of the stretches before the present one
  std::vector<Fix> longest_fixes;

  /// After the last sample.
  void keep_longest() {
    if (longest_fixes.size() > fixes.size()) {
      std::swap(samples, longest_samples);
      std::swap(fixes, longest_fixes);
    }
  }

  /// The next sample of the telemetry, by the report on it.
  void add_sample(const StepReport& report) {
    const std::size_t place = reported_++;
    if (report.sample == SampleStatus::kUsedAfterClockSetBack) {
      clock_set_back = true;
      keep_longest();
      std::swap(samples, longest_samples);
      std::swap(fixes, longest_fixes);
      samples.clear();
      fixes.clear();
    }
    if (!is_used(report.sample)) {
      return;
    }
    GyroMask used{};
    for (int k = 0; k < gyros; ++k) {
      used[k] = report.gyros[k] == GyroState::kUsed;
    }
    samples.add(place, used);
  }

  /// A fix, by the report on it.
  void add_fix(const StepReport& report) {
    if (!report.compared) {
      return;
    }
    const auto& [star_fix, readings] = *report.compared;
    Fix& fix = fixes.emplace_back();
    fix.fix = star_fix;
    fix.noise_factor = readings.noise_factor;
    fix.jitter_rad2 = readings.jitter_rad2;
    fix.rate_c = readings.rate_c;
    const auto last = std::find_if(std::next(fixes.rbegin()), fixes.rend(),
                                   [&](const Fix& other) { return other.fix.head == star_fix.head; });
    fix.since_last = last != fixes.rend() && last->fix.t < star_fix.t ? star_fix.t - last->fix.t : Duration::max();
    for (int k = 0; k < gyros; ++k) {
      fix.h_b[k] = readings.h_b[k];
      fix.used[k] = readings.used[k];
    }
  }

 private:
  std::size_t reported_ = 0;  ///< samples of the telemetry
};

}  // namespace trihedron::ground
