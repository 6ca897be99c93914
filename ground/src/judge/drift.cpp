#include "judge/drift.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <string_view>

#include "judge/findings.hpp"
#include "model/orbital_rate.hpp"
#include "trihedron/records/text.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

using Severity = Finding::Severity;

/// Log of the odds from which on a model counts as wrong against another.
constexpr double kLogOddsOfWrongModel = 10;
/// Log of the odds, 20 to 1, from which on one of two explanations counts as the right one.
constexpr double kLogOddsOfExplanation = 3;
/// ln of the odds from which on an error of the star tracker at orbital period and drift are told apart.
constexpr double kSureOfOrbit = 5;

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
    "Look for what changes the temperature of its mounting with the orbit.",
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

/// The states hold a sine about each axis. Drift that comes back with the orbit in another shape leaves a part of what
/// they moved, and where that is many of its sigmas the part is as well.
void look_at_what_orbital_drift_moved(const CalibrationRun& run, Finding& finding) {
  constexpr double kMost = 3;  // sigmas
  double most = kMost;
  std::string what;
  for (std::size_t k = 0; k < run.moved_by_orbital_drift_rad.size(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const ParameterId alignment = ParameterId::alignment(k, axis);
      const double moved_rad = run.moved_by_orbital_drift_rad[k](axis);
      const double sigmas = std::abs(moved_rad) / sigma_of(run.calibration, alignment);
      if (sigmas > most) {
        most = sigmas;
        what =
            fmt::format("; it moved {} by {}, {:.1f} of its sigmas", name_of(alignment), angle_text(moved_rad), sigmas);
      }
    }
  }
  if (!what.empty()) {
    finding.text +=
        " It is taken for a sine about each axis, and moved an alignment by many of its sigmas: drift of "
        "another shape would move it to another place.";
    finding.evidence += what;
    finding.cure += " Fly slews about two axes, which tell alignments from such drift.";
    finding.severity = Severity::kDoNotUse;
  }
}

void judge_what_comes_back(const AtOrbitalPeriod& its, const CalibrationRun& run, std::vector<Finding>& findings) {
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
  if (!is_error) {
    look_at_what_orbital_drift_moved(run, findings.back());
  }
}

}  // namespace

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

void judge_at_orbital_period(const CalibrationRun& run, std::vector<Finding>& findings) {
  judge_what_comes_back(kErrorAtOrbitalPeriod, run, findings);
  judge_what_comes_back(kDriftAtOrbitalPeriod, run, findings);
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
    const bool is_likelier = either->error - either->field > kSureOfOrbit;
    is_warning = is_warning && either->field_by_angle > -kSureOfOrbit && !is_likelier;
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
       is_warning ? Severity::kWarning : Severity::kDoNotUse});
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

}  // namespace trihedron::ground
