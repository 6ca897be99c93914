#include "judge/fixes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <map>

#include "judge/findings.hpp"
#include "judge/shape_of_errors.hpp"
#include "judge/whiteness.hpp"
#include "model/orbital_rate.hpp"
#include "trihedron/records/text.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

using Severity = Finding::Severity;

/// Relative deviation of the mean NIS from its expectation above which the noise settings are wrong, whatever the
/// number of fixes; its sigmas are then off by half of it.
constexpr double kNisTolerance = 0.025;
/// … and above which the model is wrong; the error is then absorbed by the parameters. Where fixes scatter less than
/// expected, sigmas are too large, which alone makes no result wrong.
constexpr double kNisWrong = 0.25;
/// Fraction of rejected fixes above which the result rests on a selection that the filter has made itself.
constexpr double kMostlyRejected = 0.2;
/// One in twenty.
constexpr double kManyRejected = 0.05;
/// Fewer fixes do not tell what the filter lost the momenta by.
constexpr long kFewAfterReopening = 500;
/// Twenty standard deviations of the mean of white innovations of a pass of nine hours; of one with few fixes that is
/// chance.
constexpr double kAlternating = 0.2;
constexpr double kAlternatingSure = 5;
/// Correlations and lines below these limits do no harm, however significant.
constexpr double kCorrelated = 0.05;
constexpr double kLineInSigmas = 0.1;
/// By so much too small, and one in a hundred of errors about three axes is beyond four of its sigmas.
constexpr double kSigmasTooSmall = 4 / 2.93;
/// Skewness and kurtosis below these limits do little harm, however significant; symmetric and normal errors have less
/// than so many of their standard deviations.
constexpr double kLopsided = 0.25;
constexpr double kTwoHeaps = 0.25;
constexpr double kShapeByChance = 6;

}  // namespace

void judge_number_of_fixes(const Statistics& statistics, std::vector<Finding>& findings) {
  if (statistics.fixes_used < 100) {
    add(findings, FindingCode::kTooFewFixes,
        fmt::format("Only {} star-tracker fixes could be used.", statistics.fixes_used),
        fmt::format("{} fixes in the telemetry", statistics.fixes),
        "Calibrate on a longer pass, or find out why the fixes were rejected.");
  }
}

void judge_rejections(const Statistics& statistics, std::vector<Finding>& findings) {
  const auto outliers = static_cast<double>(statistics.fixes_rejected_as_outliers);
  const auto fixes = static_cast<double>(statistics.fixes);
  if (outliers > kManyRejected * fixes) {
    add(findings, FindingCode::kManyRejected,
        fmt::format("{:.1f} % of the fixes were rejected as outliers.", 100 * outliers / fixes),
        fmt::format("{:.0f} of {:.0f}", outliers, fixes),
        "This is seldom the tracker alone: look for a clock offset, a wrong noise figure or drift outside the model.");
    if (outliers > kMostlyRejected * fixes) {
      findings.back().severity = Severity::kDoNotUse;
    }
  }
  if (statistics.reopened > 0) {
    add(findings, FindingCode::kReopened,
        "The filter lost the momenta and had to set them free: the model did not hold between fixes.",
        fmt::format("{} time(s), each after a run of rejections", statistics.reopened),
        "Raise the process noise, or look there for a gap, a jump of the tracker or drift outside the model.");
    if (statistics.fixes_used < kFewAfterReopening) {
      findings.back().evidence += fmt::format("; {} fixes used", statistics.fixes_used);
      findings.back().severity = Severity::kDoNotUse;
    }
  }
}

void judge_widenings(const std::vector<FixRecord>& fixes, Time epoch, std::vector<Finding>& findings) {
  std::vector<Time> times;
  for (const FixRecord& fix : fixes) {
    if (fix.status == FixStatus::kUsedAfterWidening) {
      times.push_back(fix.t);
    }
  }
  if (!times.empty()) {
    add(findings, FindingCode::kSigmasWidened,
        "Fixes that follow each other were off alike: the coefficients changed, or the model did not hold. The filter "
        "widened its sigmas and calibrated anew by what came after.",
        fmt::format("{} time(s), from {:.1f} min to {:.1f} min", times.size(), to_seconds(times.front() - epoch) / 60,
                    to_seconds(times.back() - epoch) / 60),
        "Calibrate the pass, which tells what changed; drift outside the drift model takes a larger one.");
  }
}

void judge_star_tracker(const Statistics& statistics, std::vector<Finding>& findings) {
  if (statistics.fixes_off_in_a_row > 0) {
    add(findings, FindingCode::kStarTrackerOff,
        "For a while the star tracker was off by more than any drift can cause, or contradicted the rest of the pass; "
        "its fixes were not used.",
        fmt::format("{} fixes, {} and more in a row", statistics.fixes_off_in_a_row, Statistics::kInARow),
        "Look at its telemetry there: a wrong identification, a head that was moved, a clock that was off.");
  }
  if (statistics.fixes_frozen > 0) {
    add(findings, FindingCode::kStarTrackerFrozen,
        "The star tracker repeated its last quaternion with new time stamps while the body turned; these fixes were "
        "not used.",
        fmt::format("{} of {} fixes", statistics.fixes_frozen, statistics.fixes),
        "Look at its telemetry there: an output that is held when no stars are identified.");
  }
}

void judge_nis(const Statistics& statistics, const std::string& what_is_wrong, std::vector<Finding>& findings) {
  if (statistics.nis_count < 1 || !statistics.nis_mean) {
    return;
  }
  const auto count = static_cast<double>(statistics.nis_count);
  const double freedom = statistics.nis_degrees_of_freedom;
  const double nis = *statistics.nis_mean;
  const boost::math::chi_squared sum(freedom * count);
  const double low = boost::math::quantile(sum, 0.0005) / count;
  const double high = boost::math::quantile(boost::math::complement(sum, 0.0005)) / count;
  if (nis >= std::min(low, freedom * (1 - kNisTolerance)) && nis <= std::max(high, freedom * (1 + kNisTolerance))) {
    return;
  }
  const bool above = nis > freedom;
  add(findings, FindingCode::kNisOutOfBounds,
      above ? "The fixes scatter more than the filter expects: " + what_is_wrong + ", and its sigmas are too small."
            : "The fixes scatter less than the filter expects: the noise is overstated, and its sigmas are too large.",
      fmt::format("mean NIS {:.3f} over {:.0f} fixes; 99.9 % of consistent filters lie in {:.3f} … {:.3f}", nis, count,
                  low, high),
      above ? "Look for a tracker clock offset, an error at orbital period or drift outside the model; correct the "
              "noise figures or "
              "raise the process noise."
            : "Correct the noise figures in pass.toml.");
  if (nis > freedom * (1 + kNisWrong)) {
    findings.back().severity = Severity::kDoNotUse;
  }
}

void judge_whiteness(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  const Whiteness found = whiteness(run.fixes, orbital_rate_rad_s(pass.star_tracker));
  constexpr const char* kCure =
      "Look for drift or a star-tracker error that the model does not have: more of [further_states], a larger drift "
      "model, estimator batch.";
  if (found.alternation > std::max(kAlternating, kAlternatingSure * found.alternation_sigma)) {
    add(findings, FindingCode::kInnovationsNotWhite,
        "Fixes are off to one side and the other by turns, as those of two star trackers that are not aligned to each "
        "other: which of them is right, the pass does not tell.",
        fmt::format("{:.2f} sigma to either side", found.alternation),
        "Give the fixes of each star tracker in a file of its own.");
    findings.back().severity = Severity::kDoNotUse;
  } else if (std::abs(found.largest_correlation) > kCorrelated &&
             !is_chance(found.correlation_square, found.degrees_of_freedom)) {
    add(findings, FindingCode::kInnovationsNotWhite,
        "Fixes that follow each other are off alike: something is left in them that the model does not have, and its "
        "sigmas are too small.",
        fmt::format(
            "autocorrelation up to {:+.3f}; N Σ r² {:.0f} of {} degrees of freedom; averages of them are off by "
            "{:.1f} times what their sigmas say",
            found.largest_correlation, found.correlation_square, found.degrees_of_freedom,
            std::sqrt(found.variance_of_mean)),
        kCure);
    if (found.variance_of_mean > kSigmasTooSmall * kSigmasTooSmall) {
      findings.back().severity = Severity::kDoNotUse;
    }
  }
  for (const Whiteness::Line& line : found.lines) {
    if (line.amplitude > kLineInSigmas && !is_chance(2 * line.power, line.degrees_of_freedom)) {
      add(findings, FindingCode::kOrbitalLine,
          fmt::format("The innovations have a line at {}the orbital rate.", line.multiple == 1 ? "" : "twice "),
          fmt::format("amplitude up to {:.2f} sigma; twice the power {:.0f} of {} degrees of freedom", line.amplitude,
                      2 * line.power, line.degrees_of_freedom),
          kCure);
    }
  }
}

void judge_shape_of_errors(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  for (int head = 0; head <= static_cast<int>(pass.further_star_trackers.size()); ++head) {
    const std::optional<ShapeOfErrors> shape = shape_of_errors(run.fixes, head);
    if (!shape) {
      continue;
    }
    const auto fixes = static_cast<double>(shape->fixes);
    const std::string name =
        pass.further_star_trackers.empty() ? "the star tracker" : fmt::format("star tracker {}", head + 1);
    if (shape->skewness > std::max(kLopsided, kShapeByChance * shape->skewness_sigma)) {
      add(findings, FindingCode::kStarTrackerErrorsNotNormal,
          fmt::format("The errors of {} lie more to one side than to the other, as outliers too small to be rejected "
                      "make them. Alignments are found by their mean, which is farther off than the sigmas say.",
                      name),
          fmt::format("skewness {:.2f} of {} fixes, of normal errors 0; mean and median {} apart", shape->skewness,
                      shape->fixes, angle_text(shape->mean_off_median_rad.norm())),
          "Find what makes these errors, as stray light or wrong stars, and leave such fixes out.");
    } else if (shape->least_kurtosis < -std::max(kTwoHeaps, kShapeByChance * std::sqrt(24 / fixes))) {
      add(findings, FindingCode::kStarTrackerErrorsNotNormal,
          fmt::format("The errors of {} lie in two heaps, as those of two star trackers that are not aligned to each "
                      "other: which of them is right, the pass does not tell.",
                      name),
          fmt::format("kurtosis {:.2f} of {} fixes, of normal errors 0", shape->least_kurtosis, shape->fixes),
          "Give the fixes of each star tracker in a file of its own.");
    }
  }
}

void judge_noise(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  if (const auto& found = run.options.star_tracker_noise_rad; found && run.options.find_noise) {
    const Eigen::Vector3d given = pass.settings.star_tracker_noise_rad / kArcsecond;
    const Eigen::Vector3d now = *found / kArcsecond;
    add(findings, FindingCode::kStarTrackerNoise,
        "The fixes do not scatter as pass.toml says; the noise found was used.",
        fmt::format("{:.1f}″ {:.1f}″ {:.1f}″ found, {:.1f}″ {:.1f}″ {:.1f}″ in pass.toml", now.x(), now.y(), now.z(),
                    given.x(), given.y(), given.z()),
        "Correct the noise figures of the star tracker in pass.toml.");
  }
}

// A few fixes whose covariances are far too small weigh as much as hundreds of others, and do not show in a mean over
// all fixes. Those told to be the most accurate are looked at by themselves; outliers are fewer than half of any group.
void judge_told_covariances(const std::vector<FixRecord>& fixes, Time epoch, std::vector<Finding>& findings) {
  constexpr std::ptrdiff_t kFewest = 8;
  constexpr double kMoreAccurate = 0.5;  // than the fix in the middle
  constexpr double kUnusual = 0.01;
  constexpr double kLittleWeight = 0.01;  // of that of all fixes
  std::map<int, std::vector<const FixRecord*>> by_head;
  for (const FixRecord& fix : fixes) {
    const bool is_judged = fix.status == FixStatus::kUsed || fix.status == FixStatus::kUsedAfterWidening ||
                           fix.status == FixStatus::kRejectedByGate;
    if (is_judged && fix.told_sigma_rad > 0 && fix.degrees_of_freedom > 0) {
      by_head[fix.head].push_back(&fix);
    }
  }
  const auto is_off = [&](const FixRecord& fix) {
    const boost::math::chi_squared its(fix.degrees_of_freedom);
    return !(fix.nis <= boost::math::quantile(boost::math::complement(its, kUnusual)));
  };
  for (auto& [head, its] : by_head) {
    std::ranges::stable_sort(its, {}, &FixRecord::told_sigma_rad);
    const double middle_rad = its[its.size() / 2]->told_sigma_rad;
    const auto others = std::ranges::upper_bound(its, kMoreAccurate * middle_rad, {}, &FixRecord::told_sigma_rad);
    const auto accurate = others - its.begin();
    std::ptrdiff_t off = 0;
    std::ptrdiff_t group = 0;  // the largest of which more than half are off
    std::ptrdiff_t off_in_group = 0;
    double weight = 0;  // of those used, in that of a fix in the middle
    double weight_of_group = 0;
    for (std::ptrdiff_t i = 0; i < accurate; ++i) {
      const FixRecord& fix = *its[static_cast<std::size_t>(i)];
      off += is_off(fix) ? 1 : 0;
      weight += fix.used() ? std::pow(middle_rad / fix.told_sigma_rad, 2) : 0;
      const bool matters = weight > kLittleWeight * static_cast<double>(its.size());
      if (i + 1 >= kFewest && 2 * off > i + 1 && matters) {
        group = i + 1;
        off_in_group = off;
        weight_of_group = weight;
      }
    }
    if (group == 0) {
      continue;
    }
    const FixRecord& last = *its[static_cast<std::size_t>(group) - 1];
    const FixRecord& first = **std::ranges::min_element(its.begin(), its.begin() + group, {}, &FixRecord::t);
    add(findings, FindingCode::kFixCovariancesTooSmall,
        "Fixes that are told to be much more accurate than the others are not: they weigh more than they should, and "
        "their errors are in the result.",
        fmt::format("star tracker {}: of {} fixes told {:.2g}″ and less, where half are told {:.2g}″ and more, {} are "
                    "off by more than one in a hundred is by chance; those used weigh as much as {:.0f} others; the "
                    "first at t_s {:.3f}",
                    head + 1, group, last.told_sigma_rad / kArcsecond, middle_rad / kArcsecond, off_in_group,
                    weight_of_group, to_seconds(first.t - epoch)),
        "Correct the covariances of these fixes (cov_*), or leave out the covariances or the fixes.");
  }
}

void judge_beside_outages(const std::optional<ErrorsBesideOutages>& errors, std::vector<Finding>& findings) {
  if (!errors) {
    return;
  }
  add(findings, FindingCode::kErrorsBesideOutages,
      errors->before ? "The star tracker is off before it loses the stars; its fixes of the ten minutes before each of "
                       "these outages were not used."
                     : "The star tracker is off after it has found the stars again; its fixes of the ten minutes after "
                       "each of these outages were not used.",
      fmt::format("{} fixes beside {} outages; off by {:.1f}″ in the mean of these, about the axis where it is most, "
                  "{} to {} min "
                  "from them, {:.0f} sigmas",
                  errors->fixes, errors->outages, errors->error_rad / kArcsecond, errors->minute, errors->minute + 2,
                  errors->sigmas),
      "Look for what lights or warms it there: the Sun or the Earth near its field of view, a new start of its filter. "
      "What is less and lasts longer stays in the fixes that were used.");
}

void judge_correlated_fixes(const std::vector<CorrelatedFixes>& star_trackers, std::vector<Finding>& findings) {
  const auto seconds = [](double s) { return fmt::format("{:.{}f} s", s, s < 10 ? 1 : 0); };
  for (const CorrelatedFixes& its : star_trackers) {
    add(findings, FindingCode::kCorrelatedFixes,
        fmt::format(
            "The errors of fixes that follow each other are alike. One fix each {} was used, so that their errors "
            "are nearly independent.",
            seconds(its.apart_s)),
        fmt::format(
            "star tracker {}: {:.0f} % of the variance has a correlation that falls to 1/e in {}; {} fixes, which "
            "come each {}, left out",
            its.head + 1, 100 * its.part, seconds(its.time_s), its.left_out, seconds(its.step_s)),
        fmt::format(
            "Where the star tracker filters its fixes, give those before the filter. Errors that the same stars "
            "make at the same places of the field of view, or a filter of the gyros, stay. On board, give one "
            "fix each {}.",
            seconds(its.apart_s)));
  }
}

}  // namespace trihedron::ground
