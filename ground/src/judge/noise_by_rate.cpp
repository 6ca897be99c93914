#include "judge/noise_by_rate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/scatter.hpp"
#include "model/slews.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

/// Rate of the body at each fix from the fix before it to the one after it, rad/s; NaN where they are far apart, and
/// where the way by the fix between is longer by half: no body turns so, and the fixes are wrong.
std::vector<double> rates_of(const StarTrackerTelemetry& star_tracker) {
  constexpr double kFarthest_s = 60;
  constexpr double kLonger = 1.5;
  const std::vector<Eigen::Quaterniond>& q_in_c = star_tracker.q_in_c;
  std::vector<double> rates(star_tracker.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 1; i + 1 < star_tracker.size(); ++i) {
    const double span_s = to_seconds(star_tracker.t[i + 1] - star_tracker.t[i - 1]);
    const double turn_rad = q_in_c[i + 1].angularDistance(q_in_c[i - 1]);
    const double way_rad = q_in_c[i].angularDistance(q_in_c[i - 1]) + q_in_c[i + 1].angularDistance(q_in_c[i]);
    const bool is_slew = turn_rad > kSlowestSlew_rad_s * span_s;
    if (span_s > 0 && span_s < kFarthest_s && !(is_slew && way_rad > kLonger * turn_rad)) {
      rates[i] = turn_rad / span_s;
    }
  }
  return rates;
}

}  // namespace

std::optional<NoiseByRate> noise_by_rate(const StarTrackerTelemetry& star_tracker,
                                         const std::vector<FixRecord>& fixes) {
  constexpr std::size_t kFewest = 50;
  const std::vector<double> rates = rates_of(star_tracker);
  std::vector<double> known;
  std::ranges::copy_if(rates, std::back_inserter(known), [](double rate) { return std::isfinite(rate); });
  if (known.empty()) {
    return std::nullopt;
  }
  const double usual_rad_s = median_of(known);
  std::vector<double> at_rest;
  std::vector<double> in_slews;
  std::vector<double> slew_rates;
  for (const FixRecord& fix : fixes) {
    const bool is_judged =
        (fix.status == FixStatus::kUsed || fix.status == FixStatus::kRejectedByGate) && std::isfinite(fix.nis);
    const auto its = std::ranges::lower_bound(star_tracker.t, fix.t);
    if (!is_judged || fix.head != 0 || fix.degrees_of_freedom == 0 || its == star_tracker.t.end() || *its != fix.t) {
      continue;
    }
    const double rate = rates[static_cast<std::size_t>(its - star_tracker.t.begin())];
    if (is_in_slew(rate, usual_rad_s)) {
      in_slews.push_back(fix.nis / fix.degrees_of_freedom);
      slew_rates.push_back(rate);
    } else if (is_at_rest(rate, usual_rad_s)) {
      at_rest.push_back(fix.nis / fix.degrees_of_freedom);
    }
  }
  if (in_slews.size() < kFewest || at_rest.size() < kFewest) {
    return std::nullopt;
  }
  return NoiseByRate{median_of(at_rest), median_of(in_slews), std::ssize(in_slews), median_of(slew_rates)};
}

void judge_noise_by_rate(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  // By chance the median of fifty squares is known to 14 %. Slews themselves, up to 3°/s and 1°/s², add nothing that is
  // seen beside that.
  constexpr double kMore = 2;
  constexpr double kMuchMore = 10;  // from there on the gate rejects half of the fixes in slews
  const std::optional<NoiseByRate> found = noise_by_rate(pass.star_tracker, run.fixes);
  if (!found || !(found->in_slews > kMore * found->at_rest)) {
    return;
  }
  const double ratio = found->in_slews / found->at_rest;
  findings.push_back(
      {FindingCode::kFixesWorseInSlews,
       "In slews the fixes are off by more than at rest: stamps that jitter, or noise of the star "
       "tracker or of the gyros that grows with the rate of the body. One noise figure does not fit both.",
       fmt::format("{:.1f} times at {:.2f} °/s, by {} fixes", std::sqrt(ratio), found->rate_rad_s / kDegree,
                   found->fixes_in_slews),
       "Look at the time stamps of the fixes, and at what the star tracker says of its own noise; leave "
       "out its fixes in fast slews, or give each fix its covariance.",
       ratio > kMuchMore ? FindingSeverity::kDoNotUse : FindingSeverity::kWarning});
}

}  // namespace trihedron::ground
