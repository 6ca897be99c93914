#include "judge/not_shown.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <string>

#include "model/scatter.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

/// As far as the state may turn the attitude unseen, 1-sigma about one axis, rad; 0 of one that does not.
double turns_rad(const Evidence& evidence, double rate_rad_s) {
  if (!evidence.open_sigma) {
    return 0;
  }
  if (evidence.state == FurtherState::kClockOffset) {
    return *evidence.open_sigma * rate_rad_s;
  }
  return evidence.state == FurtherState::kOrbitalError ? *evidence.open_sigma : 0;
}

/// At which the body turns from one fix to the next, the median; 0 where there is no second one.
double usual_rate_rad_s(const AttitudeHistory& attitude) {
  std::vector<double> rates;
  for (std::size_t i = 1; i < attitude.size(); ++i) {
    const double span_s = to_seconds(attitude.t[i] - attitude.t[i - 1]);
    if (span_s > 0) {
      rates.push_back(attitude.q_in_c[i].angularDistance(attitude.q_in_c[i - 1]) / span_s);
    }
  }
  return rates.empty() ? 0 : median_of(rates);
}

}  // namespace

void judge_what_is_not_shown(const CalibrationRun& run, std::vector<Finding>& findings) {
  constexpr double kSigmas = 3;
  std::vector<double> claimed;
  for (const Eigen::Vector3d& sigma_rad : run.attitude.sigma_rad) {
    claimed.push_back(sigma_rad.minCoeff());
  }
  if (claimed.empty()) {
    return;
  }
  const double claimed_rad = median_of(claimed);
  const double rate_rad_s = usual_rate_rad_s(run.attitude);
  std::string names;
  std::string keys;
  for (const Evidence& evidence : run.evidence) {
    const double turn_rad = turns_rad(evidence, rate_rad_s);
    if (turn_rad > kSigmas * claimed_rad) {
      names += fmt::format("{}{} {:.1f}″", names.empty() ? "" : ", ", evidence.label(), turn_rad / kArcsecond);
      keys += fmt::format("{}{} = \"off\"", keys.empty() ? "" : ", ", evidence.key());
    }
  }
  if (!names.empty()) {
    findings.push_back(
        {FindingCode::kStarTrackerErrorsNotShown,
         "This flight cannot tell errors of the star tracker apart from alignment and drift. They are taken as zero: "
         "what there is of them turns the attitude beyond the sigmas that are claimed.",
         fmt::format("1σ about an axis that is left open, where {:.1f}″ is claimed about the best known: {}",
                     claimed_rad / kArcsecond, names),
         fmt::format(
             "Calibrate by a longer pass, with slews about two axes; or say in [further_states] of the settings "
             "that there are none ({}).",
             keys)});
  }
}

}  // namespace trihedron::ground
