#include "trihedron/ground/judge/verdict.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "judge/changes.hpp"
#include "judge/clocks.hpp"
#include "judge/contradictions.hpp"
#include "judge/drift_left.hpp"
#include "judge/need.hpp"
#include "judge/noise_by_rate.hpp"
#include "judge/not_shown.hpp"
#include "judge/shape_of_errors.hpp"
#include "judge/whiteness.hpp"
#include "model/orbital_rate.hpp"
#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/core/readings.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/core/telemetry.hpp"
#include "trihedron/ground/evaluate/convergence.hpp"
#include "trihedron/ground/evaluate/used_fixes.hpp"
#include "trihedron/ground/judge/agreement.hpp"
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
/// Two nominal alignment accuracies of the system.
constexpr double kWeakAlignment_rad = 20 * kArcsecond;
/// Over this time a drift of a few degrees per day, of a gyro or of the orbit plane, is below the noise; over longer
/// times it can be mistaken for an alignment.
constexpr Duration kDriftStretch = std::chrono::minutes(10);
/// Fraction of rejected fixes above which the result rests on a selection that the filter has made itself.
constexpr double kMostlyRejected = 0.2;
/// One in twenty.
constexpr double kManyRejected = 0.05;
constexpr double kBadlyPlacedSine = 0.5;
/// Fewer fixes do not tell what the filter lost the momenta by.
constexpr long kFewAfterReopening = 500;
/// Degree of the polynomial through the samples round a fix.
constexpr int kCubic = 3;
/// The paper: alignment settles within one orbit.
constexpr double kOneOrbit_s = 90 * 60;

void add(std::vector<Finding>& findings, FindingCode code, std::string text, std::string evidence, std::string cure) {
  findings.push_back({code, std::move(text), std::move(evidence), std::move(cure)});
}

Verdict verdict_of(std::vector<Finding> findings) {
  Verdict verdict;
  verdict.findings = std::move(findings);
  verdict.trustworthy =
      std::ranges::none_of(verdict.findings, [](const Finding& f) { return f.severity == Severity::kDoNotUse; });
  return verdict;
}

void judge_number_of_fixes(const Statistics& statistics, std::vector<Finding>& findings) {
  if (statistics.fixes_used < 100) {
    add(findings, FindingCode::kTooFewFixes,
        fmt::format("Only {} star-tracker fixes could be used.", statistics.fixes_used),
        fmt::format("{} fixes in the telemetry", statistics.fixes),
        "Calibrate on a longer pass, or find out why the fixes were rejected.");
  }
}

void judge_length(const Pass& pass, std::vector<Finding>& findings) {
  const double span_s = to_seconds(pass.gyro.t.back() - pass.gyro.t.front());
  if (span_s < kOneOrbit_s) {
    add(findings, FindingCode::kShortPass,
        "The pass is shorter than one orbit: alignment and drift coefficients are not yet separated.",
        fmt::format("{:.1f} min of telemetry", span_s / 60),
        "Calibrate by a pass of three orbits: alignment takes about one, drift coefficients two to three.");
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

void judge_batch(const Statistics& statistics, std::vector<Finding>& findings) {
  if (!statistics.batch_converged.value_or(true)) {
    add(findings, FindingCode::kBatchNotConverged,
        "Least squares over the whole pass did not settle: its values are those of the last step.",
        fmt::format("{} iterations", statistics.batch_iterations.value_or(0)),
        "Use estimator invariant, and look for a model that does not hold over the whole pass.");
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

/// The events by which gyros were left out for good, or until the end of the pass.
std::vector<GyroEvent> losses(const std::vector<GyroEvent>& events, Time end) {
  constexpr Duration kForMore = std::chrono::minutes(5);
  PerGyro<GyroEvent> last{};
  for (const GyroEvent& event : events) {
    last[event.gyro] = event;
  }
  std::vector<GyroEvent> lost;
  std::ranges::copy_if(last, std::back_inserter(lost), [&](const GyroEvent& event) {
    const bool is_off = event.state == GyroState::kStuck || event.state == GyroState::kLeapt;
    return event.state == GyroState::kIsolated || (is_off && end - event.t > kForMore);
  });
  return lost;
}

/// Whether the sample of this event has no reading of its gyro, or none that is a direction.
bool is_silent(const GyroTelemetry& telemetry, const GyroEvent& event) {
  const auto i = static_cast<std::size_t>(std::ranges::find(telemetry.t, event.t) - telemetry.t.begin());
  return i < telemetry.size() && !nearly_unit(telemetry.direction(i, event.gyro).norm());
}

struct TextAndCure {
  const char* text;
  const char* cure;
};

/// Of gyros that were stuck, by their readings at these events.
TextAndCure of_stuck(const GyroTelemetry& telemetry, const std::vector<GyroEvent>& events,
                     const std::vector<GyroEvent>& lost) {
  const auto is_stuck = [](const GyroEvent& event) { return event.state == GyroState::kStuck; };
  const auto stuck = std::ranges::count_if(events, is_stuck);
  const auto silent = std::ranges::count_if(
      events, [&](const GyroEvent& event) { return is_stuck(event) && is_silent(telemetry, event); });
  if (silent == 0) {
    return {"Readings of a gyro, or one component of them, stood still, not even moved by noise; they were not used.",
            "Look at the telemetry there: a frozen readout, or the last value repeated in a gap."};
  }
  if (silent < stuck) {
    return {
        "At some times readings of a gyro, or one component of them, stood still, not even moved by noise; at others "
        "there were none, or none that are a direction. It was not used there.",
        "Look at the telemetry there: a frozen readout, the last value repeated in a gap, a gyro that was off."};
  }
  const bool is_off = std::ranges::any_of(events, [&](const GyroEvent& event) {
    return is_stuck(event) && std::ranges::any_of(lost, [&](const GyroEvent& its) { return its.gyro == event.gyro; });
  });
  return {is_off ? "A gyro gives no readings any more, or none that are a direction."
                 : "For a while a gyro gave no readings, or none that are a direction; it was not used there.",
          is_off ? "Look for why it is off; the part of the pass before can be used." : "Look for why it was off."};
}

/// Of a calibration or a navigation with so many gyros. `without_pair`: what the loss of a gyro means where it leaves
/// no pair.
void judge_gyros(const Pass& pass, const std::vector<GyroEvent>& gyro_events, int gyros, const char* without_pair,
                 std::vector<Finding>& findings) {
  const std::vector<GyroEvent> lost = losses(gyro_events, pass.gyro.t.back());
  const bool has_pair = has_pair_at_end(gyro_events, gyros, pass.gyro.t.back());
  const auto add_events = [&](GyroState state, FindingCode code, std::string text, const char* cure) {
    const auto is_of_state = [&](const GyroEvent& event) { return event.state == state; };
    std::vector<GyroEvent> events;
    std::ranges::copy_if(gyro_events, std::back_inserter(events), is_of_state);
    if (events.empty()) {
      return;
    }
    const bool breaks_pair = !has_pair && std::ranges::any_of(lost, is_of_state);
    text += breaks_pair ? without_pair : "";
    add(findings, code, std::move(text), fmt::format("{}", fmt::join(texts_of(events, pass.settings.epoch), "; ")),
        cure);
    if (breaks_pair) {
      findings.back().severity = Severity::kDoNotUse;
    }
  };
  add_events(GyroState::kIsolated, FindingCode::kGyroIsolated,
             "A gyro alone did not agree with the rest, time after time, and was left out.",
             "Look at its telemetry from there on.");
  const TextAndCure stuck = of_stuck(pass.gyro, gyro_events, lost);
  add_events(GyroState::kStuck, FindingCode::kGyroStuck, stuck.text, stuck.cure);
  add_events(GyroState::kLeapt, FindingCode::kGyroLeapt,
             "Readings of a gyro leapt farther than a body turns from one sample to the next; they were not used until "
             "they were back, or for an hour.",
             "Look at the telemetry there: columns or gyros exchanged, a sign, samples of another time.");
}

void judge_gyro_rate(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  const double period_s = to_seconds(pass.settings.gyro_period);
  if (const long thinned = run.samples[SampleStatus::kThinned]; thinned > 0) {
    add(findings, FindingCode::kGyroSamplesThinned,
        fmt::format(
            "The gyros were sampled faster than the calibration uses: up to {} samples per second are used, the "
            "others were left out.",
            std::chrono::seconds(1) / Readings<2>::kMinSpacing),
        fmt::format("{} of {} samples left out; sampled every {:.3g} s", thinned, pass.gyro.size(), period_s),
        "Send fewer of them where that saves telemetry: the calibration is the same.");
  }
  CalibrationSetup setup;
  const Duration usual_reach = setup.reach();
  setup.gyro_period = pass.settings.gyro_period;
  if (const Duration reach = setup.reach(); reach > usual_reach) {
    const bool interpolates = run.options.estimator == Estimator::kPaper;
    add(findings, FindingCode::kGyroSamplesFarApart,
        "The gyro samples are far apart: what the gyros read at the time of a fix is taken from samples further away, "
        "which limits the accuracy while the body accelerates.",
        interpolates
            ? fmt::format("interpolated between samples {:.3g} s apart", period_s)
            : fmt::format("sampled every {:.3g} s, so that a cubic is fitted over ±{:.3g} s instead of ±{:.3g} s",
                          period_s, to_seconds(reach), to_seconds(usual_reach)),
        fmt::format("Sample the gyros every {:.3g} s or more often.",
                    2 * to_seconds(usual_reach) / DirectionsFit::least_samples(kCubic)));
    // A warning of what may be; here it is, and the attitude is off as the fixes are, which is in no sigma.
    if (std::ranges::find(findings, FindingCode::kFixesWorseInSlews, &Finding::code) != findings.end()) {
      findings.back().severity = Severity::kDoNotUse;
    }
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

/// Probability of a false alarm on a good pass.
constexpr double kFalseAlarm = 1e-5;
/// Twenty standard deviations of the mean of white innovations of a pass of nine hours; of one with few fixes that is
/// chance.
constexpr double kAlternating = 0.2;
constexpr double kAlternatingSure = 5;
/// Correlations and lines below these limits do no harm, however significant.
constexpr double kCorrelated = 0.05;
constexpr double kLineInSigmas = 0.1;
/// By so much too small, and one in a hundred of errors about three axes is beyond four of its sigmas.
constexpr double kSigmasTooSmall = 4 / 2.93;

bool is_chance(double square, int degrees_of_freedom) {
  return degrees_of_freedom == 0 || square <= boost::math::quantile(boost::math::complement(
                                                  boost::math::chi_squared(degrees_of_freedom), kFalseAlarm));
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

/// Skewness and kurtosis below these limits do little harm, however significant; symmetric and normal errors have less
/// than so many of their standard deviations.
constexpr double kLopsided = 0.25;
constexpr double kTwoHeaps = 0.25;
constexpr double kShapeByChance = 6;

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

void judge_halves(const CalibrationRun& run, std::vector<Finding>& findings) {
  const Statistics& statistics = run.calibration.statistics;
  const double square = statistics.halves_chi_square.value_or(0);
  const int freedom = statistics.halves_degrees_of_freedom.value_or(0);
  if (!is_chance(square, freedom)) {
    add(findings, FindingCode::kHalvesDisagree,
        "The first half of the pass gives other parameters than the whole: they moved, or the model is incomplete.",
        fmt::format("chi-square {:.0f} of {} degrees of freedom", square, freedom),
        "Let the coefficients change (coefficient_change = \"on\" in [further_states]), give more process noise, or "
        "calibrate a shorter pass.");
    // Of coefficients that are found to change it is no other evidence: what that makes of them is in their sigmas, or
    // their course is followed, of which half a pass may not show much.
    const bool is_followed = run.options.further_states.change_course != CourseOfChange::Kind::kEven;
    const bool is_told = std::ranges::any_of(findings, [&](const Finding& finding) {
      return (finding.code == FindingCode::kCoefficientsNotConstant && finding.severity != Severity::kDoNotUse) ||
             (finding.code == FindingCode::kCoefficientsChanged && is_followed);
    });
    if (is_told) {
      findings.back().severity = Severity::kWarning;
    }
  }
}

/// Log of the odds from which on a model counts as wrong against another.
constexpr double kLogOddsOfWrongModel = 10;
/// Log of the odds, 20 to 1, from which on one of two explanations counts as the right one.
constexpr double kLogOddsOfExplanation = 3;

/// By forecasts, where models were compared by them.
void judge_drift_model_by_forecasts(const CalibrationRun& run, std::vector<Finding>& findings) {
  const auto& models = run.drift_models;
  const auto used = std::ranges::find_if(models, [&](const DriftModelForecast& model) {
    return model.drift_model == run.calibration.gyros[0].drift_model;
  });
  if (used == models.end()) {
    return;
  }
  const auto likelier = [](const DriftModelForecast& a, const DriftModelForecast& b) {
    return a.log_likelihood < b.log_likelihood;
  };
  const auto evidence = [&](const DriftModelForecast& better) {
    return fmt::format("{} is more likely by a factor of e^{:.0f}; forecast error {:.1f}″ in place of {:.1f}″",
                       name_of(better.drift_model), better.log_likelihood - used->log_likelihood,
                       better.open_loop_rms_rad / kArcsecond, used->open_loop_rms_rad / kArcsecond);
  };
  const auto larger = std::max_element(used, models.end(), likelier);
  if (larger->log_likelihood > used->log_likelihood + kLogOddsOfWrongModel) {
    add(findings, FindingCode::kDriftModelTooSmall,
        "The gyros drift in a way that the drift model does not contain; its coefficients and sigmas are wrong.",
        evidence(*larger), fmt::format("Use drift model {}, or {}.", name_of(larger->drift_model), kAutoDriftModel));
  }
  const auto smaller = std::max_element(models.begin(), std::next(used), likelier);
  if (smaller->log_likelihood > used->log_likelihood + kLogOddsOfWrongModel) {
    add(findings, FindingCode::kDriftModelTooLarge,
        "The drift model has coefficients that the pass does not support: they add their own error to what comes next.",
        evidence(*smaller), fmt::format("Use drift model {}, or {}.", name_of(smaller->drift_model), kAutoDriftModel));
  }
  if (used + 1 == models.end() && models.size() > 1 && used->drift_model == kLargestDriftModel &&
      used->log_likelihood > std::prev(used)->log_likelihood + kLogOddsOfWrongModel) {
    const DriftModelForecast& next_smaller = *std::prev(used);
    add(findings, FindingCode::kDriftModelAtItsLimit,
        "Even the largest drift model is not clearly enough: there may be drift of still higher degree.",
        fmt::format("it is more likely than {} by a factor of e^{:.0f}; forecast error {:.1f}″ in place of {:.1f}″",
                    name_of(next_smaller.drift_model), used->log_likelihood - next_smaller.log_likelihood,
                    used->open_loop_rms_rad / kArcsecond, next_smaller.open_loop_rms_rad / kArcsecond),
        "Do not trust single coefficients; the forecast error says what the attitude suffers.");
  }
}

void judge_drift_model(const CalibrationRun& run, std::vector<Finding>& findings) {
  judge_drift_model_by_forecasts(run, findings);
  const bool is_told = std::ranges::find(findings, FindingCode::kDriftModelTooSmall, &Finding::code) != findings.end();
  if (!run.against_field || is_told) {
    return;
  }
  const auto& [log_odds, instead] = *run.against_field;
  if (log_odds > kLogOddsOfWrongModel) {
    add(findings, FindingCode::kDriftModelTooSmall,
        "The gyros drift in a way that eq. (1) does not contain; its coefficients and sigmas are wrong.",
        fmt::format("the pass is more likely with drift as a field by a factor of e^{:.0f}", log_odds),
        fmt::format("Use drift model {}.", kAutoDriftModel));
  } else if (!instead.empty() && log_odds > -kLogOddsOfExplanation) {
    std::string keys;
    for (const FurtherState state : instead) {
      keys += fmt::format("{}{}", keys.empty() ? "" : ", ", row_of(state).key);
    }
    add(findings, FindingCode::kDriftModelTooSmall,
        "What was found beside eq. (1) may as well be drift that eq. (1) does not contain: then coefficients and "
        "sigmas are wrong.",
        fmt::format("{} found; ln of the odds of drift as a field, without it, {:+.1f}", keys, log_odds),
        fmt::format("Use drift model {}; or, where {} is known to be there, say \"on\" in [further_states].",
                    kAutoDriftModel, keys));
  }
}

void judge_change(const CalibrationRun& run, std::vector<Finding>& findings) {
  std::string names;
  for (const FurtherEstimate& state : run.calibration.further) {
    if (state.parameter.is_further(FurtherState::kCoefficientChange) && std::abs(state.value) > 3 * state.sigma) {
      names += fmt::format("{}{} {:+.2e} ± {:.0e} rad/s", names.empty() ? "" : ", ", name_of(state.parameter),
                           state.value, state.sigma);
    }
  }
  if (names.empty()) {
    return;
  }
  const FurtherStateOptions& states = run.options.further_states;
  const double minutes = to_seconds(states.change_time) / 60;
  switch (states.change_course) {
    case CourseOfChange::Kind::kEven:
      add(findings, FindingCode::kCoefficientsChanged,
          "Drift coefficients changed over the pass; those given are of its end, and may go on changing.", names,
          "Calibrate again soon: the rotors may still be warming up.");
      break;
    case CourseOfChange::Kind::kWarmUp:
      add(findings, FindingCode::kCoefficientsChanged,
          fmt::format("Drift coefficients changed as in a warm-up, of which 1/e was left after {:.1f} min; those given "
                      "are of the end of the pass.",
                      minutes),
          names, "What is still to come of it is in the errors that are predicted; look for what warmed the rotors.");
      break;
    case CourseOfChange::Kind::kJump:
      add(findings, FindingCode::kCoefficientsChanged,
          fmt::format("Drift coefficients jumped {:.1f} min after the start of the pass; those given hold since.",
                      minutes),
          names, "Look for what happened then.");
      break;
  }
}

/// ln of the odds from which on an error of the star tracker at orbital period and drift are told apart.
constexpr double kSureOfOrbit = 5;

/// What is said of states that come back with the orbit.
struct AtOrbitalPeriod {
  FurtherState state;
  FindingCode code;
  std::string_view found;
  std::string_view cause;  ///< what to look for
  std::string_view alike;  ///< that it may be the other
  std::string_view causes_of_both;
  std::string_view other;
};

constexpr AtOrbitalPeriod kErrorAtOrbitalPeriod = {
    FurtherState::kOrbitalError,
    FindingCode::kOrbitalErrorFound,
    "The star tracker has an error at orbital period; the calibration has taken account of it.",
    "Look for what warms its mounting.",
    "The star tracker has an error at orbital period, or the gyros have drift at it: both look alike, and it was taken "
    "for an error of the star tracker. Sigmas do not tell of drift.",
    "Look for what follows the orbit: the temperature of the mounting, or that of the gyros, a magnetic field. Where "
    "the star tracker is known to have no such error: orbital_error = \"off\" in [further_states].",
    "drift at that period"};

constexpr AtOrbitalPeriod kDriftAtOrbitalPeriod = {
    FurtherState::kOrbitalDrift,
    FindingCode::kOrbitalDriftFound,
    "The gyros have drift at orbital period; the calibration has taken account of it.",
    "Look for what follows the orbit: the temperature of the gyros, a magnetic field.",
    "The gyros have drift at orbital period, or the star tracker has an error at it: both look alike, and it was taken "
    "for drift. Sigmas do not tell of the error.",
    "Look for what follows the orbit: the temperature of the gyros, a magnetic field, or the temperature of the star "
    "tracker's mounting. Where the gyros are known to have no such drift: orbital_drift = \"off\" in [further_states].",
    "an error of the star tracker"};

/// The largest of the states of a kind, of those that are so many sigmas; null where none is.
const FurtherEstimate* largest_of(const CalibrationRun& run, FurtherState kind, double least_sigmas) {
  const FurtherEstimate* largest = nullptr;
  for (const FurtherEstimate& state : run.calibration.further) {
    const bool counts = state.parameter.is_further(kind) && std::abs(state.value) >= least_sigmas * state.sigma;
    if (counts && (largest == nullptr || std::abs(state.value) > std::abs(largest->value))) {
      largest = &state;
    }
  }
  return largest;
}

void judge_at_orbital_period(const AtOrbitalPeriod& its, const CalibrationRun& run, std::vector<Finding>& findings) {
  constexpr double kSigmasToReport = 5;
  const bool is_error = its.state == FurtherState::kOrbitalError;
  std::optional<double> over_other = run.orbital_error_over_drift;
  if (over_other && !is_error) {
    over_other = -*over_other;
  }
  // Drift that is taken in place of an error of the star tracker, but of which nothing is seen for itself, is told
  // apart by so little that a few outliers may do it.
  const bool is_unseen =
      !is_error && !run.options.further_states.is_on(FurtherState::kOrbitalError) &&
      largest_of(run, its.state, 0) != nullptr && largest_of(run, its.state, kSigmasToReport) == nullptr &&
      std::ranges::any_of(run.evidence, [&](const Evidence& of) { return of.state == its.state && of.accepted; });
  const bool may_be_other = (over_other && *over_other < kSureOfOrbit) || is_unseen;
  // What may be the other is told however small it is: where it is the other, its sigmas mean nothing.
  const FurtherEstimate* const largest = largest_of(run, its.state, may_be_other ? 0 : kSigmasToReport);
  if (largest == nullptr) {
    return;
  }
  const ParameterId& parameter = largest->parameter;
  const bool has_several = std::ranges::any_of(run.calibration.further, [&](const FurtherEstimate& estimate) {
    return estimate.parameter.is_further(its.state) && estimate.parameter.owner > 0;
  });
  const std::string of_which = has_several ? fmt::format(", of star tracker {}", parameter.owner + 1) : std::string();
  const std::string size = is_error ? fmt::format("largest component {:.1f}″{}", largest->value / kArcsecond, of_which)
                                    : fmt::format("largest amplitude {:.1e} rad/s, the {} about axis {} of gyro {}",
                                                  largest->value, parameter.component < 3 ? "sine" : "cosine",
                                                  "xyz"[parameter.component % 3], parameter.gyro() + 1);
  const std::string odds =
      over_other ? fmt::format("; ln of its odds against {} {:+.1f}", its.other, *over_other) : std::string();
  add(findings, its.code, std::string(may_be_other ? its.alike : its.found),
      fmt::format("{}, {:.0f} sigmas{}", size, std::abs(largest->value / largest->sigma), odds),
      std::string(may_be_other ? its.causes_of_both : its.cause));
  if (may_be_other) {
    findings.back().severity = Severity::kDoNotUse;
  }
}

void judge_field_or_error(const CalibrationRun& run, std::vector<Finding>& findings) {
  const std::optional<double>& error_over_field = run.orbital_error_over_field;
  const std::optional<FieldOrError>& either = run.field_or_error;
  std::vector<std::string> evidence;
  bool is_warning = true;
  if (error_over_field && *error_over_field > -kSureOfOrbit) {
    is_warning = false;
    evidence.push_back(fmt::format(
        "ln of the odds of such an error, with drift by eq. (1) alone, against the drift {:+.1f}", *error_over_field));
  }
  if (either && either->field_by_angle < kSureOfOrbit) {
    is_warning = is_warning && either->field_by_angle > -kSureOfOrbit;
    evidence.push_back(
        fmt::format("ln of the odds of the drift {:+.1f}, of such an error {:+.1f}; of drift as large by the angle "
                    "between the momenta, which the gyros read without the star tracker, {:+.1f}",
                    either->field, either->error, either->field_by_angle));
  }
  if (evidence.empty()) {
    return;
  }
  findings.push_back(
      {FindingCode::kOrbitalErrorOrDrift,
       "What was taken for drift that eq. (1) does not contain may as well be an error of the star tracker that comes "
       "back with the orbit: in this pass both look alike. Sigmas do not tell of the error.",
       fmt::format("{}", fmt::join(evidence, "; ")),
       "Look whether aberration is corrected, whether heads take turns, whether the mounting bends with the Sun. "
       "Calibrate by a longer pass, with more fixes and with slews about two axes. Where the star tracker is known to "
       "have no error at orbital period: orbital_error = \"off\" in [further_states].",
       is_warning ? Finding::Severity::kWarning : Finding::Severity::kDoNotUse});
}

void judge_polhodes(const CalibrationRun& run, std::vector<Finding>& findings) {
  constexpr double kSigmasToReport = 5;
  constexpr double kNearlyAlike = 0.1;
  const FurtherEstimate* const largest = largest_of(run, FurtherState::kPolhode, kSigmasToReport);
  if (largest == nullptr) {
    return;
  }
  std::vector<double> periods_min;
  for (std::size_t k = 0; k < run.calibration.gyros.size(); ++k) {
    periods_min.push_back(static_cast<double>(run.options.further_states.polhodes[static_cast<int>(k)].period_s) / 60);
  }
  const double orbit_min =
      2 * std::numbers::pi / std::abs(run.options.orbital_rate_rad_s.value_or(kLowOrbit_rad_s)) / 60;
  const bool may_be_orbit = std::ranges::any_of(
      periods_min, [&](double period_min) { return std::abs(period_min / orbit_min - 1) < kNearlyAlike; });
  add(findings, FindingCode::kPolhodeFound,
      fmt::format("The coefficients come and go as with the polhode of each rotor{}; the calibration has taken account "
                  "of it.",
                  may_be_orbit ? ", or with day and night" : ""),
      fmt::format("periods at the start of the pass {:.1f} min; largest amplitude {:.1e} rad/s, {}, {:.0f} sigmas",
                  fmt::join(periods_min, " and "), largest->value, name_of(largest->parameter),
                  std::abs(largest->value / largest->sigma)),
      "Calibrate again after some of these periods: they change, and what is not known of them is in no sigma.");
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

void judge_readout_noise(const std::optional<ReadoutNoise>& noise, std::vector<Finding>& findings) {
  if (noise) {
    const auto text = [&](const PerGyro<double>& noise_rad) {
      std::string all;
      for (int k = 0; k < noise->gyros; ++k) {
        all += fmt::format("{}{:.2g}″", k == 0 ? "" : " ", noise_rad[k] / kArcsecond);
      }
      return all;
    };
    const double lasting = *std::max_element(noise->lasting.begin(), noise->lasting.begin() + noise->gyros);
    add(findings, FindingCode::kReadoutNoise,
        "The readings of the gyros do not scatter as pass.toml says; the noise found was used.",
        fmt::format("{} found{}, up to {} for an hour{}, {} in pass.toml", text(noise->found_rad),
                    lasting > 1
                        ? fmt::format(", {:.1f} times what single readings show, since their noise lasts", lasting)
                        : "",
                    text(noise->most_rad),
                    noise->in_slews >= 1.05 ? fmt::format(", {:.1f} times as much in slews", noise->in_slews) : "",
                    text(noise->told_rad)),
        noise->is_steady() ? "Correct the noise figures of the gyros in pass.toml."
                           : "Look for what makes the readings noisier in slews or for a part of the pass: there the "
                             "attitude is worse than its sigmas. Cut such a part off.");
    if (!noise->is_steady()) {
      findings.back().severity = Severity::kDoNotUse;
    }
  }
}

void judge_determination(const CalibrationRun& run, std::vector<Finding>& findings) {
  std::string names;
  for (std::size_t i = 0; i < run.calibration.states.size(); ++i) {
    // Members outside eq. (1) are estimated to protect the others; they need not be determined themselves.
    const ParameterId& state = run.calibration.states[i];
    const bool outside = state.is_drift() && !state.coefficient.is_in_eq1();
    if (!outside && !is_determined(run, i)) {
      names += (names.empty() ? "" : ", ") + name_of(state);
    }
  }
  if (!names.empty()) {
    add(findings, FindingCode::kNotDetermined,
        "The data do not determine " + names + "; they are hardly better known than before.",
        "posterior sigma above half of the prior sigma", "Calibrate on a longer pass, with slews.");
  }
}

/// Root mean square over the sphere of the drift outside eq. (1) that a field was found to make, rad/s; gyro by gyro.
std::vector<double> rms_outside_eq1(const Calibration& calibration) {
  std::vector<double> square(calibration.gyros.size(), 0.0);
  for (const DriftFieldLevel& level : calibration.drift_field) {
    square[static_cast<std::size_t>(level.gyro)] += level.rms_rad_s * level.rms_rad_s;
  }
  std::ranges::transform(square, square.begin(), [](double its) { return std::sqrt(its); });
  return square;
}

/// Whether coefficients of eq. (1) and alignments are together where the prior lets them be.
void judge_prior_as_a_whole(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  constexpr double kSure = 1 - 1e-6;
  std::vector<ParameterId> states;
  std::ranges::copy_if(run.calibration.states, std::back_inserter(states), [](const ParameterId& state) {
    return state.is_alignment() || (state.is_drift() && state.coefficient.is_in_eq1());
  });
  const auto rows = rows_of(run.calibration, states);  // the prior has the same
  const Eigen::VectorXd off = difference(run.known_before, run.calibration, states);
  const Agreement agrees =
      agreement_with_prior(off, run.known_before.covariance(rows, rows), run.calibration.covariance(rows, rows), kSure);
  if (agrees.holds()) {
    return;
  }
  const bool of_file = pass.settings.prior.has_value();
  add(findings, FindingCode::kPriorContradicted,
      of_file
          ? "The pass contradicts the earlier calibration that it was given as prior: coefficients or alignments are "
            "others by now, and the result lies between both."
          : "Coefficients and alignments together are found outside what the settings say of them before the pass, "
            "and the result is off with it.",
      fmt::format("chi-square {:.2g} of {} degrees of freedom; all but one in a million lie below {:.3g}",
                  agrees.chi_square, agrees.degrees_of_freedom, agrees.limit),
      of_file ? "Calibrate without the prior: coefficients change at every start of a rotor. Where both are of one "
                "start-up, calibrate both passes together, which tells what has moved."
              : "Give larger prior sigmas in pass.toml, and check the means and their units.");
}

/// An earlier calibration is judged as a whole. Parameters that a prior holds too tightly pull others away with them,
/// or leave what they should be to drift outside eq. (1), which is a small part of it where priors are right.
void judge_prior_sigmas(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  constexpr double kSigmas = 5;
  constexpr double kSigmasOfField = 3;
  if (pass.settings.prior) {
    return;
  }
  std::string names;
  const auto name = [&](const std::string& what, double sigmas) {
    names += fmt::format("{}{} by {:.0f}", names.empty() ? "" : ", ", what, sigmas);
  };
  std::vector<double> largest_sigma(run.calibration.gyros.size(), 0.0);  // of coefficients of eq. (1)
  for (std::size_t i = 0; i < run.calibration.states.size(); ++i) {
    const ParameterId& state = run.calibration.states[i];
    const bool is_coefficient = state.is_drift() && state.coefficient.is_in_eq1();
    if (!state.is_alignment() && !is_coefficient) {
      continue;
    }
    const double sigma = std::sqrt(run.known_before.covariance.diagonal()(static_cast<Eigen::Index>(i)));
    if (is_coefficient) {
      largest_sigma[state.gyro()] = std::max(largest_sigma[state.gyro()], sigma);
    }
    const double off = std::abs(value_of(run.calibration, state) - value_of(run.known_before, state));
    // Where the data tell little, what makes up for drift outside eq. (1) may leave it less known than before.
    if (off > kSigmas * std::hypot(sigma, sigma_of(run.calibration, state))) {
      name(name_of(state), off / sigma);
    }
  }
  const std::vector<double> outside = rms_outside_eq1(run.calibration);
  for (std::size_t k = 0; k < outside.size(); ++k) {
    if (largest_sigma[k] > 0 && outside[k] > kSigmasOfField * largest_sigma[k]) {
      name(fmt::format("drift of gyro {} outside eq. (1), against that of a coefficient of eq. (1),", k + 1),
           outside[k] / largest_sigma[k]);
    }
  }
  if (!names.empty()) {
    add(findings, FindingCode::kPriorContradicted,
        "Parameters are found outside what the settings say of them before the pass: they are held too tightly, and "
        "others are off with them.",
        "in prior sigmas: " + names, "Give larger prior sigmas in pass.toml, and check their units.");
  }
}

void judge_steadiness(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  // Outliers are left out: they would seem to move a steady axis.
  const StarTrackerTelemetry used = used_fixes(pass, run.fixes);
  const Eigen::Vector3d& noise = pass.settings.star_tracker_noise_rad;
  const auto observability = alignment_observability(used, noise, noise.minCoeff());
  if (observability.sigma_rad <= kWeakAlignment_rad) {
    return;
  }
  const Eigen::Vector3d& axis = observability.weakest_axis_c;
  const bool believes = run.options.estimator == Estimator::kPaper;
  add(findings, FindingCode::kWeakAlignmentAxis,
      fmt::format(
          "Steady flight: the axis ({:+.3f}, {:+.3f}, {:+.3f}) in c is fixed in the body and in space (the "
          "orbit normal, where the spacecraft faces the Earth), so the alignment of each gyro about it cannot be "
          "separated from its initial direction. {} The attitude does not suffer while the flight stays steady.",
          axis.x(), axis.y(), axis.z(),
          believes ? "Estimator paper takes noise for information there: its sigmas about this axis are too small."
                   : "The sigmas say so."),
      std::isfinite(observability.sigma_rad)
          ? fmt::format("about {} at best about this axis from the fixes alone", angle_text(observability.sigma_rad))
          : "the fixes alone do not determine it",
      "Fly slews about the other axes during the calibration: ten minutes of 10° and more suffice.");
  // What is not known is in the sigmas, and by them the forecast for flight as in the pass is made.
  const std::optional<OpenLoopForecast>& forecast = run.calibration.forecast;
  if (!believes && forecast && forecast->need && forecast->need->met) {
    Finding& finding = findings.back();
    finding.severity = Severity::kWarning;
    finding.text += " The need that is stated is met with these sigmas.";
  }
}

void judge_unused_sensors(const Pass& pass, const CalibrationRun& run, std::vector<Finding>& findings) {
  const auto used = static_cast<int>(run.calibration.gyros.size());
  if (pass.gyro.gyros > used) {
    add(findings, FindingCode::kGyrosNotUsed,
        fmt::format("Estimator {} works on a pair: gyros beyond the first {} were not used.",
                    name_of(run.options.estimator), used),
        fmt::format("{} gyros in the telemetry", pass.gyro.gyros), "Put the pair you want first.");
  }
  const bool second = std::ranges::any_of(run.calibration.further, [](const FurtherEstimate& state) {
    return state.parameter.is_further(FurtherState::kStarTrackerAlignment);
  });
  const std::size_t heads = second ? 2 : 1;
  if (1 + pass.further_star_trackers.size() > heads) {
    add(findings, FindingCode::kStarTrackersNotUsed,
        fmt::format("Estimator {} of {} gyros works with {} star tracker{}: those beyond were not used.",
                    name_of(run.options.estimator), used, heads, second ? "s" : ""),
        fmt::format("{} star trackers in the telemetry", 1 + pass.further_star_trackers.size()),
        "Put those that you want first.");
  }
}

void judge_pair(const CalibrationRun& run, std::vector<Finding>& findings) {
  const auto angle = angle_between<double>(run.calibration.gyros[0].momentum_in, run.calibration.gyros[1].momentum_in);
  if (std::sin(angle) < kBadlyPlacedSine) {
    add(findings, FindingCode::kPairBadlyPlaced,
        "The momenta lie within 30° of one line: the attitude about them is worse than the readout by 1/sinθ.",
        fmt::format("angle {:.1f}°, factor {:.1f}", angle * 180 / std::numbers::pi, 1 / std::sin(angle)),
        "Start one rotor along another axis.");
  }
}

// ---- Of a navigation

/// Share of the samples without attitude, or of the corrections missed, that shows that something is wrong, …
constexpr double kSomeMissing = 0.05;
/// … and from which on the result is an exception.
constexpr double kMostMissing = 0.5;

constexpr const char* kLookAtCalibration =
    "Look at the calibration in use: its units (rad/s, rad), whether it is of these gyros and of this start-up.";

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

/// Longer than the passes of one campaign are apart: without the name of the start-up nothing says that the rotors have
/// not been started since.
constexpr Duration kSameStartUp = std::chrono::days(30);

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

bool has_pair_at_end(const std::vector<GyroEvent>& gyro_events, int gyros, Time end) {
  return gyros >= static_cast<int>(losses(gyro_events, end).size()) + 2;
}

std::vector<std::string> texts_of(const std::vector<GyroEvent>& events, Time epoch) {
  struct Seen {
    long times = 0;
    Time first{};
  };
  std::map<std::pair<int, GyroState>, Seen> seen;
  for (const GyroEvent& event : events) {
    Seen& its = seen[{event.gyro, event.state}];
    its.first = its.times++ == 0 ? event.t : its.first;
  }
  std::vector<std::string> texts;
  for (const auto& [what, its] : seen) {
    const double minutes = to_seconds(its.first - epoch) / 60;
    texts.push_back(fmt::format("gyro {} {}{} {:.1f} min", what.first + 1, name_of(what.second),
                                its.times > 1 ? fmt::format(" {} times, first at", its.times) : " at", minutes));
  }
  return texts;
}

AlignmentObservability alignment_observability(const StarTrackerTelemetry& tracker,
                                               const Eigen::Vector3d& tracker_noise_rad, double fix_noise_rad) {
  // With a free direction φ in each stretch, fixes y = φ − C δ leave Σ (C − mean C)ᵀ (C − mean C) of information on δ.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  double count = 0;
  double total = 0;
  const auto close_stretch = [&] {
    if (count > 0) {
      information += count * Eigen::Matrix3d::Identity() - sum.transpose() * sum / count;
    }
    total += count;
    sum.setZero();
    count = 0;
  };
  for (std::size_t i = 0; i < tracker.size(); ++i) {
    if (i > 0 &&
        (tracker.t[i] - tracker.t.front()) / kDriftStretch != (tracker.t[i - 1] - tracker.t.front()) / kDriftStretch) {
      close_stretch();
    }
    if (nearly_unit(tracker.q_in_c[i].norm())) {
      sum += tracker.q_in_c[i].normalized().toRotationMatrix();
      ++count;
    }
  }
  close_stretch();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information);
  AlignmentObservability result;
  result.weakest_axis_c = solver.eigenvectors().col(0);
  // The tracker's own noise makes a steady axis seem to move.
  const double noise =
      total * (tracker_noise_rad.cwiseAbs2().array() * (1 - result.weakest_axis_c.array().square())).sum();
  result.sigma_rad = fix_noise_rad / std::sqrt(std::max(solver.eigenvalues()(0) - noise, 0.0));
  return result;
}

Verdict judge(const Pass& pass, const CalibrationRun& run) {
  std::vector<Finding> findings;
  const Statistics& statistics = run.calibration.statistics;
  judge_number_of_fixes(statistics, findings);
  judge_length(pass, findings);
  judge_rejections(statistics, findings);
  judge_nis(statistics, "its model is incomplete or the noise is understated", findings);
  judge_noise(pass, run, findings);
  judge_readout_noise(run.readout_noise, findings);
  judge_correlated_fixes(run.correlated_fixes, findings);
  judge_whiteness(pass, run, findings);
  judge_shape_of_errors(pass, run, findings);
  judge_drift_left(pass, run, findings);
  judge_drift_model(run, findings);
  judge_change(run, findings);
  judge_changes(run, findings);
  judge_halves(run, findings);
  judge_clocks(pass, run, findings);
  judge_at_orbital_period(kErrorAtOrbitalPeriod, run, findings);
  judge_at_orbital_period(kDriftAtOrbitalPeriod, run, findings);
  judge_field_or_error(run, findings);
  judge_polhodes(run, findings);
  judge_beside_outages(run.beside_outages, findings);
  judge_determination(run, findings);
  const std::size_t before_priors = findings.size();
  judge_prior_sigmas(pass, run, findings);
  if (findings.size() == before_priors) {
    judge_prior_as_a_whole(pass, run, findings);
  }
  judge_steadiness(pass, run, findings);
  judge_pair(run, findings);
  judge_star_tracker(statistics, findings);
  judge_contradictions(run.fixes, run.gyro_events, pass.settings.epoch, findings);
  judge_noise_by_rate(pass, run, findings);
  judge_what_is_not_shown(run, findings);
  judge_batch(statistics, findings);
  judge_gyros(pass, run.gyro_events, static_cast<int>(run.calibration.gyros.size()),
              " Without it there is no pair at the end of the pass, and no attitude but at fixes.", findings);
  judge_gyro_rate(pass, run, findings);
  judge_unused_sensors(pass, run, findings);
  judge_need(run.calibration.forecast, findings);
  return verdict_of(std::move(findings));
}

Verdict judge_navigation(const Pass& pass, const NavigationRun& run) {
  std::vector<Finding> findings;
  judge_prior(pass.settings, run, findings);
  if (run.held_parameters_misfit && *run.held_parameters_misfit > run.misfit_limit) {
    add(findings, FindingCode::kCalibrationDoesNotFit,
        "The parameters held do not fit this pass: the calibration that ran along moved away from them by more than "
        "their sigmas allow.",
        fmt::format("misfit {:.0f} (squared, in sigmas); 99.9 % of fitting calibrations lie below {:.0f}",
                    *run.held_parameters_misfit, run.misfit_limit),
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
  judge_gyros(pass, run.gyro_events, run.gyros, " Without it there is no pair at the end of the pass, and no attitude.",
              findings);
  judge_readout_noise(run.readout_noise, findings);
  judge_correlated_fixes(run.correlated_fixes, findings);
  judge_nis(run.statistics, "the calibration in use does not fit this pass, or the model is incomplete", findings);
  judge_need(run.forecast, findings);
  return verdict_of(std::move(findings));
}

}  // namespace trihedron::ground
