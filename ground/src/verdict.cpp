#include "trihedron/ground/verdict.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "trihedron/core/frames.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron::ground {
namespace {

using Severity = Finding::Severity;

constexpr double kArcsecond = std::numbers::pi / 180 / 3600;

/// A mean NIS off its expectation by more than this part says that the noise is not what the filter was told, whatever
/// the number of fixes; its sigmas are then off by half of it.
constexpr double kNisTolerance = 0.05;
/// …and by more than this, that the model is wrong: the error hides in the parameters.
constexpr double kNisWrong = 0.25;
/// Two nominal alignment accuracies of the system.
constexpr double kWeakAlignment_rad = 20 * kArcsecond;
/// The paper: alignment settles within one orbit.
constexpr double kOneOrbit_s = 90 * 60;

double statistic(const CalibrationRun& run, const char* name) {
  const auto found = run.calibration.statistics.find(name);
  return found == run.calibration.statistics.end() ? 0 : found->second;
}

void judge_number_of_fixes(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  const double used = statistic(run, "fixes_used");
  if (used < 100) {
    findings.push_back({"too-few-fixes", fmt::format("Only {:.0f} star-tracker fixes could be used.", used),
                        fmt::format("{:.0f} fixes in the telemetry", statistic(run, "fixes")),
                        "Calibrate on a longer pass, or find out why the fixes were rejected.", Severity::kDoNotUse});
  }
  const double span_s = pass.gyro.t.empty() ? 0 : to_seconds(pass.gyro.t.back() - pass.gyro.t.front());
  if (span_s < kOneOrbit_s) {
    findings.push_back({"short-pass",
                        "The pass is shorter than one orbit: alignment and drift coefficients are not yet told apart.",
                        fmt::format("{:.0f} min of telemetry", span_s / 60),
                        "Alignment takes about one orbit, drift coefficients two to three.", Severity::kWarning});
  }
}

void judge_rejections(const CalibrationRun& run, std::vector<Finding>& findings) {
  const double outliers = statistic(run, "fixes_rejected_as_outliers");
  const double fixes = statistic(run, "fixes");
  if (outliers > 0.05 * fixes) {
    findings.push_back(
        {"many-rejected", fmt::format("{:.1f} % of the fixes were rejected as outliers.", 100 * outliers / fixes),
         fmt::format("{:.0f} of {:.0f}", outliers, fixes),
         "More than one in twenty is seldom the tracker alone: look for a clock offset, a wrong noise figure or drift "
         "outside the model.",
         outliers > 0.5 * fixes ? Severity::kDoNotUse : Severity::kWarning});
  }
  if (const double reopened = statistic(run, "reopened"); reopened > 0) {
    findings.push_back(
        {"reopened", "The filter lost the momenta and had to be set free: the drift model did not hold between fixes.",
         fmt::format("{:.0f} times, each after {} rejections in a row", reopened, run.options.reopen_after_rejections),
         "Raise the process noise, or look for a gap, a jump of the tracker or drift outside the model there.",
         Severity::kWarning});
  }
}

void judge_nis(const CalibrationRun& run, std::vector<Finding>& findings) {
  const double count = statistic(run, "nis_count");
  const double freedom = statistic(run, "nis_degrees_of_freedom");
  if (count < 1) {
    return;
  }
  const double nis = statistic(run, "nis_mean");
  const boost::math::chi_squared sum(freedom * count);
  const double low = boost::math::quantile(sum, 0.0005) / count;
  const double high = boost::math::quantile(boost::math::complement(sum, 0.0005)) / count;
  if (nis >= std::min(low, freedom * (1 - kNisTolerance)) && nis <= std::max(high, freedom * (1 + kNisTolerance))) {
    return;
  }
  const bool above = nis > freedom;
  const bool wrong = nis > freedom * (1 + kNisWrong) || nis < freedom * (1 - kNisWrong);
  findings.push_back(
      {"nis-out-of-bounds",
       above
           ? "The fixes scatter more than the filter expects: its model is incomplete or the noise is understated, and "
             "its sigmas are too small."
           : "The fixes scatter less than the filter expects: the noise is overstated, and its sigmas are too large.",
       fmt::format("mean NIS {:.3f} over {:.0f} fixes; 99.9 % of consistent filters lie in {:.3f} … {:.3f}", nis, count,
                   low, high),
       above
           ? "Look for a tracker clock offset, an error at orbital period, drift outside the model; correct the noise "
             "figures or raise the process noise."
           : "Correct the noise figures in pass.toml.",
       wrong ? Severity::kDoNotUse : Severity::kWarning});
}

void judge_determination(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  // Against the first sigmas after the start, which are those of the prior.
  const auto& history = run.parameters;
  if (history.sigma.empty()) {
    return;
  }
  std::string names;
  for (std::size_t i = 0; i < run.calibration.states.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double sigma = std::sqrt(run.calibration.covariance(row, row));
    if (sigma > 0.5 * history.sigma.front()[i]) {
      names += (names.empty() ? "" : ", ") + run.calibration.states[i];
    }
  }
  if (!names.empty()) {
    findings.push_back({"not-determined",
                        "The data do not determine: " + names + ". Their values and sigmas are those of the prior.",
                        "posterior sigma above half of the prior sigma",
                        "Fly slews during the calibration, or a longer pass.", Severity::kWarning});
  }

  const auto observability = alignment_observability(pass.star_tracker, pass.settings.star_tracker_noise_rad,
                                                     pass.settings.star_tracker_noise_rad.minCoeff());
  if (observability.sigma_rad > kWeakAlignment_rad) {
    const Eigen::Vector3d& axis = observability.weakest_axis_c;
    findings.push_back(
        {"weak-alignment-axis",
         fmt::format("Steady flight: the body turns about one axis, ({:+.3f}, {:+.3f}, {:+.3f}) in c, which is fixed "
                     "in the body and in "
                     "space. Each gyro's alignment about it cannot be told from that gyro's initial direction. "
                     "Estimator {} takes noise "
                     "for information there: its sigmas about this axis are too small. The attitude itself does not "
                     "suffer while the "
                     "flight stays steady.",
                     axis.x(), axis.y(), axis.z(), run.options.estimator),
         fmt::format("at best {:.0f}″ about this axis from the fixes alone", observability.sigma_rad / kArcsecond),
         "Fly slews about the other axes during the calibration; ten minutes of 10° and more suffice.",
         Severity::kDoNotUse});
  }
}

void judge_pair(const CalibrationRun& run, std::vector<Finding>& findings) {
  if (run.calibration.gyros.size() < 2) {
    return;
  }
  const double angle =
      angle_between<double>(run.calibration.gyros[0].momentum_in, run.calibration.gyros[1].momentum_in);
  if (std::sin(angle) < 0.5) {
    findings.push_back(
        {"pair-badly-placed",
         "The momenta lie within 30° of one line: the attitude about them is worse than the readout by 1/sinθ.",
         fmt::format("angle {:.1f}°, factor {:.1f}", angle * 180 / std::numbers::pi, 1 / std::sin(angle)),
         "Start one rotor along another axis.", Severity::kWarning});
  }
}

}  // namespace

AlignmentObservability alignment_observability(const StarTrackerTelemetry& tracker,
                                               const Eigen::Vector3d& tracker_noise_rad, double fix_noise_rad) {
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  double count = 0;
  for (const Eigen::Quaterniond& q : tracker.q_in_c) {
    if (nearly_unit(q.norm())) {
      mean += q.normalized().toRotationMatrix();
      ++count;
    }
  }
  AlignmentObservability result;
  if (count < 2) {
    result.sigma_rad = std::numeric_limits<double>::infinity();
    return result;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(mean / count, Eigen::ComputeFullU | Eigen::ComputeFullV);
  result.weakest_axis_c = svd.matrixV().col(0);
  const double strayed = 1 - std::pow(svd.singularValues()(0), 2);
  // The tracker's own noise makes the axis seem to stray.
  const double noise = (tracker_noise_rad.cwiseAbs2().array() * (1 - result.weakest_axis_c.array().square())).sum();
  result.sigma_rad = fix_noise_rad / std::sqrt(count * std::max(strayed - noise, 0.0));
  return result;
}

Verdict judge(const Pass& pass, const CalibrationRun& run) {
  Verdict verdict;
  judge_number_of_fixes(pass, run, verdict.findings);
  judge_rejections(run, verdict.findings);
  judge_nis(run, verdict.findings);
  judge_determination(pass, run, verdict.findings);
  judge_pair(run, verdict.findings);
  verdict.trustworthy = std::none_of(verdict.findings.begin(), verdict.findings.end(),
                                     [](const Finding& f) { return f.severity == Severity::kDoNotUse; });
  return verdict;
}

}  // namespace trihedron::ground
