#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "judge/clocks.hpp"
#include "judge/contradictions.hpp"
#include "judge/findings.hpp"
#include "judge/fixes.hpp"
#include "judge/gyros.hpp"
#include "judge/need.hpp"
#include "trihedron/ground/judge/verdict.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

using Severity = Finding::Severity;

/// Share of the samples without attitude, or of the corrections missed, that shows that something is wrong, …
constexpr double kSomeMissing = 0.05;
/// … and from which on the result is an exception.
constexpr double kMostMissing = 0.5;

constexpr const char* kLookAtCalibration =
    "Look at the calibration in use: its units (rad/s, rad), whether it is of these gyros and of this start-up.";

/// Fixes that were rejected in a row and are off alike, all star trackers together. Outliers, and noise of a star
/// tracker in slews, are to all sides; where the parameters in use, or the star tracker, are off they are alike. Not
/// those that contradict a first fix, which was an outlier then.
long rejected_alike(const std::vector<FixRecord>& fixes, long least_in_a_row) {
  constexpr double kAlike = 0.5;  // R, the square of the mean over the mean square
  struct Row {
    long fixes = 0;
    Eigen::VectorXd sum;
    double square = 0;
  };
  std::map<int, Row> rows;  // by star tracker
  FixStatus last_used = FixStatus::kNone;
  long alike = 0;
  const auto end = [&](Row& row) {
    const auto count = static_cast<double>(row.fixes);
    if (row.fixes >= least_in_a_row && row.sum.squaredNorm() > kAlike * count * row.square) {
      alike += row.fixes;
    }
    row = {};
  };
  for (const FixRecord& fix : fixes) {
    Row& row = rows[fix.head];
    if (fix.status == FixStatus::kRejectedByGate && !fix.jumped) {
      const Eigen::VectorXd off = Eigen::VectorXd::Map(fix.innovation.data(), std::ssize(fix.innovation));
      row.sum = row.fixes > 0 ? Eigen::VectorXd(row.sum + off) : off;
      row.square += off.squaredNorm();
      ++row.fixes;
      continue;
    }
    if (last_used == FixStatus::kStarted && fix.status == FixStatus::kUsedAfterReopening) {
      rows.clear();
    } else {
      end(row);
    }
    last_used = fix.used() ? fix.status : last_used;
  }
  for (auto& [head, row] : rows) {
    end(row);
  }
  return alike;
}

/// Whether fixes contradict the calibration that a navigation began with. Where they contradict one gyro alone, that is
/// told already.
void judge_rejected_alike(const std::vector<FixRecord>& fixes, std::vector<Finding>& findings) {
  // Of so many, independent errors are alike in one row of 2000 (four components, R ~ Beta(2, 14)), and in one of 30
  // where all are about one axis.
  constexpr long kLeastInARow = 8;
  constexpr long kLeast = 40;  // twice as many as it takes to reopen the filter
  constexpr double kSome = 0.01;
  constexpr double kMany = 0.05;  // from which on `many-rejected` is told
  const long alike = rejected_alike(fixes, kLeastInARow);
  const double share = static_cast<double>(alike) / static_cast<double>(std::max(fixes.size(), std::size_t{1}));
  const bool is_told = std::ranges::find(findings, FindingCode::kGyroContradicted, &Finding::code) != findings.end();
  if (alike >= kLeast && share > kSome && !is_told) {
    add(findings, FindingCode::kCalibrationDoesNotFit, share > kMany ? Severity::kDoNotUse : Severity::kWarning,
        "Fixes that follow each other contradict the attitude alike and were rejected: the calibration in use does not "
        "fit the pass, or for a while the star tracker was off.",
        fmt::format("{} of {} fixes, {} and more in a row", alike, fixes.size(), kLeastInARow),
        "Calibrate by this pass: it tells whether alignments are others by now, as after work on the star tracker, or "
        "drift coefficients, as after a start of a rotor.");
  }
}

/// Longer than the passes of one campaign are apart: without the name of the start-up nothing says that the rotors have
/// not been started since.
constexpr Duration kSameStartUp = std::chrono::days(30);

/// The momenta of any pair that can be used are tens of degrees apart: where a few percent of the samples give no
/// attitude because they are predicted nearly parallel, it is the parameters that are wrong; or the readings leap with
/// a body that shakes. Other samples may be refused for a stuck gyro; in a gap there are none.
void judge_coverage(const NavigationRun& run, std::vector<Finding>& findings) {
  const long used = run.samples[SampleStatus::kUsed];
  const long parallel = run.samples[SampleStatus::kRejectedGeometry] + used - static_cast<long>(run.attitude.size());
  const long too_few = run.samples[SampleStatus::kRejectedTooFewGyros];
  const auto missing = static_cast<double>(parallel + too_few);
  const auto all = static_cast<double>(run.samples[SampleStatus::kRejectedGeometry] + used + too_few);
  if (missing <= kSomeMissing * all) {
    return;
  }
  add(findings, FindingCode::kAttitudeIncomplete, "From the first fix on, many gyro samples have no attitude.",
      fmt::format("{:.0f} of {:.0f} samples: no attitude by the readings at {}, too few gyros at {}", missing, all,
                  parallel, too_few),
      parallel > too_few
          ? fmt::format("{} Or the body shakes faster than the gyros are read: a reading that does not continue those "
                        "before it is not believed.",
                        kLookAtCalibration)
          : "Look at the gyros with `trihedron inspect`, and at the calibration in use: a gyro that does "
            "not fit it is left out.");
  if (static_cast<double>(parallel) > kSomeMissing * all || missing > kMostMissing * all) {
    findings.back().severity = Severity::kDoNotUse;
  }
}

void judge_corrections(const NavigationRun& run, std::vector<Finding>& findings) {
  const auto missed = static_cast<double>(run.corrections_missed);
  const auto due = missed + static_cast<double>(run.corrections);
  if (missed > kSomeMissing * due) {
    add(findings, FindingCode::kCorrectionsMissed,
        "Astro-corrections were due that could not be made, though there were fixes.",
        fmt::format("{:.0f} of {:.0f}", missed, due),
        "Look why the fixes were not used: the star tracker, the gyros, or the calibration in use.");
    if (missed > kMostMissing * due) {
      findings.back().severity = Severity::kDoNotUse;
    }
  }
}

/// Open loops have errors in common, those of the parameters in use, so that their mean may scatter as much as one of
/// them. 99.9 % of consistent ones lie below the first limit. Beyond the second the errors are three times the sigmas
/// claimed: what is said to hold in 99.7 % of the cases is then the usual error.
void judge_open_loops(const NavigationRun& run, std::vector<Finding>& findings) {
  if (run.open_loops.empty()) {
    return;
  }
  constexpr double kFreedom = 3;
  constexpr double kWrong = 9 * kFreedom;
  const double limit = boost::math::quantile(boost::math::chi_squared(kFreedom), 0.999);
  double sum = 0;
  double worst_rad = 0;
  for (const OpenLoopEnd& end : run.open_loops) {
    sum += end.square;
    worst_rad = std::max(worst_rad, end.error_rad);
  }
  const double mean = sum / static_cast<double>(run.open_loops.size());
  if (mean <= limit) {
    return;
  }
  add(findings, FindingCode::kAttitudeOffFixes,
      "Just before the corrections the attitude was off the fixes by more than its sigmas allow.",
      fmt::format("{:.1f} times the sigmas, up to {:.1f}″, at the ends of {} open loops", std::sqrt(mean / kFreedom),
                  worst_rad / kArcsecond, run.open_loops.size()),
      kLookAtCalibration);
  if (!(mean <= kWrong)) {
    findings.back().severity = Severity::kDoNotUse;
  }
}

/// The calibration that the navigation began with; where its values are not held it is a start only.
void judge_prior(const PassSettings& settings, const NavigationRun& run, std::vector<Finding>& findings) {
  if (!settings.prior) {
    return;
  }
  const Calibration& prior = *settings.prior;
  // A calibration that only does not meet the need of another user is not wrong.
  if (!prior.verdict.trustworthy && !fails_a_need_alone(prior.verdict)) {
    std::vector<std::string_view> why;
    for (const Finding& finding : prior.verdict.findings) {
      if (finding.severity == Severity::kDoNotUse) {
        why.push_back(name_of(finding.code));
      }
    }
    add(findings, FindingCode::kCalibrationNotTrustworthy, "The calibration in use has the verdict: do not use.",
        why.empty() ? "it gives no reason" : fmt::format("{}", fmt::join(why, ", ")),
        "Do what its own findings say, or take another calibration.");
    if (!run.held_parameters_misfit) {
      findings.back().severity = Severity::kWarning;
    }
  }
  const bool both_named = !prior.start_up.empty() && !settings.start_up.empty();
  const Duration later = settings.epoch - prior.epoch;
  if (both_named ? prior.start_up == settings.start_up : std::chrono::abs(later) <= kSameStartUp) {
    return;
  }
  add(findings, FindingCode::kCalibrationOfAnotherTime,
      both_named ? "The calibration in use is of another start-up of the rotors, at which drift coefficients change: "
                   "the attitude between corrections may be off by more than its sigmas say."
                 : "The calibration in use is of a pass long ago or long after, and nothing says that the rotors ran "
                   "all the time: drift coefficients change at every start, and the attitude between corrections may "
                   "be off by more than its sigmas say.",
      both_named ? fmt::format("start-up {} in place of {}", prior.start_up, settings.start_up)
                 : fmt::format("made {:.0f} days {} this pass", std::abs(to_seconds(later)) / 86400,
                               later > Duration::zero() ? "before" : "after"),
      both_named ? "Calibrate on this pass, or on another one of its start-up."
                 : "Calibrate on this pass, or name the start-up (start_up) in the pass.toml of both.");
}

}  // namespace

Verdict judge_navigation(const Pass& pass, const NavigationRun& run) {
  std::vector<Finding> findings;
  judge_prior(pass.settings, run, findings);
  if (run.held_parameters_misfit && !(*run.held_parameters_misfit <= run.misfit_limit)) {
    add(findings, FindingCode::kCalibrationDoesNotFit,
        "The parameters held do not fit this pass: the calibration that ran along moved away from them by more than "
        "their sigmas allow.",
        fmt::format("misfit of {} {:.0f} (squared, in sigmas); 99.9 % of fitting calibrations lie below {:.0f}",
                    run.misfit_of, *run.held_parameters_misfit, run.misfit_limit),
        "Calibrate anew; drift coefficients change at every start of a rotor.");
  }
  judge_clocks(pass, run, findings);
  judge_coverage(run, findings);
  judge_corrections(run, findings);
  judge_open_loops(run, findings);
  judge_rejections(run.statistics, findings);
  judge_widenings(run.fixes, pass.settings.epoch, findings);
  judge_star_tracker(run.statistics, findings);
  judge_contradictions(run.fixes, run.gyro_events, pass.settings.epoch, findings);
  if (run.held_parameters_misfit || pass.settings.prior) {
    judge_rejected_alike(run.fixes, findings);
  }
  judge_gyros(pass, run.gyro_events, run.gyros, " Without it there is no pair at the end of the pass, and no attitude.",
              findings);
  judge_told_covariances(run.fixes, pass.settings.epoch, findings);
  judge_bursts(run.bursts, findings);
  judge_readout_noise(run.readout_noise, findings);
  judge_correlated_fixes(run.correlated_fixes, findings);
  judge_nis(run.statistics, "the calibration in use does not fit this pass, or the model is incomplete", findings);
  judge_need(run.forecast, findings);
  return verdict_of(std::move(findings));
}

}  // namespace trihedron::ground
