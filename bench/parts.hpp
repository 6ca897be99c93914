#pragma once
/// The parts that a nine-hour pass goes through, each so that it can be run alone: by Google Benchmark for its time
/// (parts_bench.cpp), and once under callgrind for its instructions (count_parts.cpp).

#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "flight.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::bench {

/// Something that can be run again and again with the same result.
using Run = std::function<void()>;

struct Part {
  std::string name;
  /// Makes what it needs, which is not measured, and returns what is.
  std::function<Run()> prepare;
};

/// Of nine hours of the paper's experiment, in the order in which a pass goes through them.
[[nodiscard]] const std::vector<Part>& parts();

/// Samples of a pair in the paper's nine hours.
inline constexpr long kSamples = 9L * 3600 * 8 + 1;

/// A simulated pass as the on-board step gets it.
struct Events {
  std::vector<GyroSample> samples;
  std::vector<StarFix> fixes;
};
[[nodiscard]] Events events_of(const Scenario& scenario);
/// The paper's scenario over another time, without drift outside eq. (1).
[[nodiscard]] Scenario scenario_of(double hours);

/// Of the body relative to `in` between two fixes, rad/s.
[[nodiscard]] inline Eigen::Vector3d rate_c(const StarFix& from, const StarFix& to) {
  return (Rot<C, In>::assume(from.q_in_c.conjugate()) * Rot<In, C>::assume(to.q_in_c)).log().raw() /
         to_seconds(to.t - from.t);
}

/// The filter alone, of a pair with eq. (1): attitude and prediction at each sample, update at each fix.
template <class Estimator>
[[nodiscard]] Run filter(std::shared_ptr<const Events> events, bool use_fixes = true) {
  const auto estimator = std::make_shared<Estimator>();
  return [=] {
    const test::Given<Estimator> given;
    TRIHEDRON_ASSERT(!estimator->set_up(given.setup, given.prior, given.covariance));
    FixReadings readings;
    readings.used = all_gyros(2);
    auto fix = events->fixes.begin();
    for (const GyroSample& sample : events->samples) {
      if (estimator->started()) {
        const auto C_in_c = estimator->rotation(estimator->gyros(), sample.h_b, readings.used);
        estimator->predict(C_in_c.value().raw(), sample.h_b, sample.t, 0.125);
      }
      if (fix != events->fixes.end() && fix->t <= sample.t) {
        if (use_fixes || !estimator->started()) {
          readings.h_b = sample.h_b;
          if (fix != events->fixes.begin()) {
            readings.rate_c = rate_c(*std::prev(fix), *fix);
          }
          static_cast<void>(estimator->correct(*fix, readings));
        }
        ++fix;
      }
    }
  };
}

/// The whole on-board step of a pair with eq. (1).
[[nodiscard]] Run on_board(std::shared_ptr<const Events> events, bool navigate);

/// The pipeline of the ground over a pass, with everything decided; `states`: how many it estimates.
struct PipelineRun {
  Run run;
  int states = 0;
};
[[nodiscard]] PipelineRun pipeline(const Scenario& scenario, const CalibrationOptions& options);

/// Options that leave nothing to decide.
[[nodiscard]] CalibrationOptions all_told();

}  // namespace trihedron::bench
