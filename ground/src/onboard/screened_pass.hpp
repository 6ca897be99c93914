#pragma once
/// The usable samples and fixes of a pass, as screened by the on-board step.

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "trihedron/core/step_report.hpp"
#include "trihedron/core/telemetry.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// In the order of their times; where the clock was set back, the stretch with the most fixes.
struct ScreenedPass {
  [[nodiscard]] static Directions unread() {
    Directions h_b;
    std::ranges::fill(h_b, Eigen::Vector3d::UnitX());
    return h_b;
  }
  struct Sample {
    Time t{};
    Directions h_b = unread();  ///< unit, where used
    GyroMask used{};
  };
  struct Fix {
    StarFix fix;
    Directions h_b = unread();  ///< fitted through several samples
    GyroMask used{};
    double noise_factor = 1;                ///< as of FixReadings
    Eigen::Vector3d rate_c{0, 0, 0};        ///< of the body relative to `in`, rad/s
    Duration since_last = Duration::max();  ///< fix of the same star tracker
  };

  int gyros = 0;
  std::vector<Sample> samples;
  std::vector<Fix> fixes;  ///< used or rejected as outliers; all star trackers
  bool clock_set_back = false;
  std::vector<Sample> longest_samples;  ///< of the stretches before the present one
  std::vector<Fix> longest_fixes;

  /// After the last sample.
  void keep_longest() {
    if (longest_fixes.size() > fixes.size()) {
      std::swap(samples, longest_samples);
      std::swap(fixes, longest_fixes);
    }
  }

  /// The next sample of the pass and the report on it.
  void add_sample(const GyroSample& its, const StepReport& report) {
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
    Sample& sample = samples.emplace_back();
    sample.t = its.t;
    for (int k = 0; k < gyros; ++k) {
      sample.h_b[k] = its.h_b[k].normalized();
      sample.used[k] = report.gyros[k] == GyroState::kUsed;
    }
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
    fix.rate_c = readings.rate_c;
    const auto last = std::find_if(std::next(fixes.rbegin()), fixes.rend(),
                                   [&](const Fix& other) { return other.fix.head == star_fix.head; });
    fix.since_last = last != fixes.rend() && last->fix.t < star_fix.t ? star_fix.t - last->fix.t : Duration::max();
    for (int k = 0; k < gyros; ++k) {
      fix.h_b[k] = readings.h_b[k];
      fix.used[k] = readings.used[k];
    }
  }
};

}  // namespace trihedron::ground
