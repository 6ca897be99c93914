#include "choose/orbital_drift.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>

#include "choose/by_pass.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;

/// Drift at this period looks like aberration as well.
Decision without_aberration(Decision decision) {
  std::erase_if(decision.changes, [](const Change& change) { return change.moving == Moving::kAberration; });
  return decision;
}

/// Eq. (1) in place of a field, with the least noise: the field, and noise, have taken a part of what comes back.
CalibrationOptions by_eq1(const CalibrationOptions& asked, CalibrationOptions with_field) {
  with_field.drift_field = false;
  with_field.drift_model = kEsg7;
  with_field.direction_random_walk_rad_sqrt_s = asked.direction_random_walk_rad_sqrt_s;
  with_field.further_states[FurtherState::kWanderingDrift] = Choice::kOff;
  return with_field;
}

struct ByEq1InsteadOfField {
  double log_likelihood;
  OrbitalOdds odds;  ///< where the error was found it is there, and those of drift are beside it
  OddsOfErrors of_errors;
};

/// Where a decision has a field.
std::optional<ByEq1InsteadOfField> by_eq1_instead_of_field(const Pass& pass, const Screened& screened,
                                                           const CalibrationOptions& asked, const Decision& decision) {
  if (!decision.field || !(decision.field->log_evidence > kLogOddsToAccept)) {
    return std::nullopt;
  }
  const Trial trial(pass, screened, by_eq1(asked, decision.options));
  return ByEq1InsteadOfField{trial.log_likelihood(), orbital_odds(trial), odds_of_errors(trial)};
}

/// ln of the odds of the field of a decision, of each gyro for itself, against none by what no error of the star
/// tracker moves, the angle between the momenta: fixes of a hundred times their noise say next to nothing of the
/// attitude.
double field_by_angle(const Pass& pass, const Screened& screened, const Decision& decision) {
  constexpr double kBlind = 100;
  CalibrationOptions options = decision.options;
  options.star_tracker_noise_rad =
      kBlind * options.star_tracker_noise_rad.value_or(pass.settings.star_tracker_noise_rad);
  return Trial(pass, screened, options).log_odds_of_field(decision.field->sigma_rad_s);
}

/// Where a good part of what a field explains is explained by an error of the star tracker as well.
std::optional<FieldOrError> field_or_error(const Pass& pass, const Screened& screened, const CalibrationOptions& asked,
                                           const Decision& decision,
                                           const std::optional<ByEq1InsteadOfField>& instead) {
  constexpr double kGoodPart = 0.3;
  if (!instead || asked.further_states[FurtherState::kOrbitalError] == Choice::kOff) {
    return std::nullopt;
  }
  const double by_field = decision.log_likelihood - instead->log_likelihood;
  if (instead->of_errors.with_orbit < kGoodPart * by_field) {
    return std::nullopt;
  }
  return FieldOrError{by_field, instead->of_errors.with_orbit, field_by_angle(pass, screened, decision)};
}

/// What the odds say of an error of the star tracker and of drift at orbital period.
class AtOrbit {
 public:
  /// Of a decision with odds. `instead`: where it has a field.
  AtOrbit(const Decision& decision, const std::optional<ByEq1InsteadOfField>& instead)
      : odds_(*decision.orbital_odds),
        drift_odds_(odds_.drift),
        both_odds_(odds_.both),
        has_field_(instead.has_value()),
        has_error_(decision.options.further_states.is_on(FurtherState::kOrbitalError)) {
    if (!instead) {
      return;
    }
    const double less = instead->log_likelihood - decision.log_likelihood;
    both_odds_ = has_error_ ? instead->odds.drift : instead->odds.both;
    both_over_field_ = less + log_odds(both_odds_);
    if (!has_error_) {
      drift_odds_ = instead->odds.drift;
      drift_over_field_ = less + log_odds(drift_odds_);
    }
    const double aberration = instead->of_errors.aberration - kUnusual;
    if (const double error_odds = has_error_ ? aberration : std::max(log_odds(instead->odds.error), aberration);
        error_odds > kLogOddsToAccept) {
      error_over_field_ = less + error_odds;
    }
  }

  [[nodiscard]] bool has_error() const { return has_error_; }
  /// Where a field was found, and eq. (1) alone would show an error of the star tracker in its place, at orbital period
  /// or by aberration: ln of the likelihood by eq. (1) with the error less that of the field.
  [[nodiscard]] std::optional<double> error_over_field() const { return error_over_field_; }
  [[nodiscard]] double error_over_drift() const { return log_odds(odds_.error) - log_odds(odds_.drift); }
  [[nodiscard]] bool may_be_drift() const {
    constexpr double kMayBeDrift = 20;
    return (odds_.drift.by_prior_as_it_is > kMayBeThere && error_over_drift() < kMayBeDrift) ||
           drift_over_field_ > kMayBeThere;
  }
  /// `has_one`: one of them was found.
  [[nodiscard]] bool may_be_both(bool has_one) const {
    const double over_one =
        odds_.both.by_prior_as_it_is - std::max(odds_.error.by_prior_as_it_is, odds_.drift.by_prior_as_it_is);
    return (has_one && over_one > kMayBeThere) || both_over_field_ > std::max(drift_over_field_, kMayBeThere);
  }
  /// By how much more than their likelihoods, which are by the priors as they are, drift or both are likelier than what
  /// was decided.
  [[nodiscard]] double more_for_drift() const { return by_narrower(drift_odds_) - of_decided(); }
  [[nodiscard]] double more_for_both() const { return by_narrower(both_odds_) - of_decided(); }

 private:
  /// Members of the field, or noise, that were found without what comes back have taken a part of it: its odds are
  /// larger than these.
  static constexpr double kMayBeThere = -10;
  /// ln of the odds before any pass for drift outside eq. (1), which all rotors have, against aberration that nobody
  /// corrects.
  static constexpr double kUnusual = 5;

  /// Drift that all gyros have alike, as an error of the star tracker looks, is not to be expected by eq. (1) alone.
  /// Beside other drift it is, and of any size.
  [[nodiscard]] double log_odds(const LogEvidence& of) const { return has_field_ ? of.value : of.by_prior_as_it_is; }
  [[nodiscard]] double by_narrower(const LogEvidence& of) const { return log_odds(of) - of.by_prior_as_it_is; }
  [[nodiscard]] double of_decided() const { return has_error_ ? by_narrower(odds_.error) : 0; }

  OrbitalOdds odds_;
  LogEvidence drift_odds_;
  LogEvidence both_odds_;
  bool has_field_;
  bool has_error_;
  /// ln of the likelihood by eq. (1) with drift, or both, less that of the field.
  double drift_over_field_ = -std::numeric_limits<double>::infinity();
  double both_over_field_ = -std::numeric_limits<double>::infinity();
  std::optional<double> error_over_field_;
};

/// What is decided with drift at orbital period.
struct WithDrift {
  CalibrationOptions options;  ///< what was asked for, with it
  Decision decision;
  double gain;  ///< of the logarithm of the likelihood
  bool counts;

  [[nodiscard]] Decision take(CalibrationOptions& asked) && {
    asked = std::move(options);
    return without_aberration(std::move(decision));
  }
};

/// `gain`: beside that of the likelihood; `at_least`: for which it counts.
WithDrift with_orbital_drift(const Pass& pass, const Screened& screened, CalibrationOptions options,
                             const DriftModelId& largest_model, const Progress& progress, double gain,
                             double at_least) {
  begin_stage(progress, "looks for drift at orbital period");
  options.further_states[FurtherState::kOrbitalDrift] = Choice::kOn;
  Decision decision = decide_by_pass(pass, screened, options, largest_model, progress);
  gain += decision.log_likelihood;
  const bool counts = gain > at_least && is_all_that_is_left(decision);
  return {std::move(options), std::move(decision), gain, counts};
}

/// How far the alignment of each gyro is from that without drift at orbital period, about c axes, rad.
std::vector<Eigen::Vector3d> moved_from(const Decision& without, const Decision& with) {
  std::vector<Eigen::Vector3d> moved_rad;
  for (int k = 0; k < with.nearby->layout.gyros; ++k) {
    const Eigen::Matrix3d& before = without.nearby->solution.gyros[k].C_c_b;
    const Eigen::Matrix3d& after = with.nearby->solution.gyros[k].C_c_b;
    moved_rad.push_back(Rot<C, C>::assume(Eigen::Matrix3d(after * before.transpose())).log().raw());
  }
  return moved_rad;
}

}  // namespace

bool is_all_that_is_left(const Decision& by_drift) {
  constexpr double kMost = 0.1;
  const CalibrationOptions& options = by_drift.options;
  const Layout& layout = by_drift.nearby->layout;
  double square = 0;
  for (int k = 0; k < layout.gyros; ++k) {
    square += by_drift.nearby->solution.gyros[k]
                  .drift_rad_s.segment(layout.orbital_column(), layout.drift_columns() - layout.orbital_column())
                  .squaredNorm();
  }
  const double drift_rad_s = std::sqrt(square / layout.amplitudes_size());
  // A random walk as drift that wanders for as long as the phase takes for a radian.
  const double walk_rad_s =
      options.direction_random_walk_rad_sqrt_s * std::sqrt(std::abs(*options.orbital_rate_rad_s) / 2);
  const bool wanders = options.further_states.is_on(FurtherState::kWanderingDrift);
  return std::max(walk_rad_s, wanders ? options.further_states.wandering_drift_rad_s : 0) < kMost * drift_rad_s;
}

Decision decide_on_orbital_drift(const Pass& pass, const Screened& screened, CalibrationOptions& asked,
                                 const DriftModelId& largest_model, const Progress& progress) {
  constexpr FurtherState kError = FurtherState::kOrbitalError;
  constexpr FurtherState kDrift = FurtherState::kOrbitalDrift;
  constexpr double kLeastPhase = 3 * std::numbers::pi;
  const bool is_open = asked.further_states[kDrift] == Choice::kAuto;
  if (is_open) {
    asked.further_states[kDrift] = Choice::kOff;
  }
  Decision decision = decide_by_pass(pass, screened, asked, largest_model, progress);
  if (!decision.orbital_odds) {
    return decision;
  }
  const auto instead = by_eq1_instead_of_field(pass, screened, asked, decision);
  decision.field_or_error = field_or_error(pass, screened, asked, decision, instead);
  const AtOrbit at_orbit(decision, instead);
  if (asked.further_states[kError] == Choice::kAuto) {
    decision.orbital_error_over_field = at_orbit.error_over_field();
  }
  CalibrationOptions without_error = asked;
  CalibrationOptions with_error = asked;
  with_error.further_states[kError] = Choice::kOn;
  if (at_orbit.has_error()) {
    decision.orbital_error_over_drift = at_orbit.error_over_drift();
    without_error.further_states[kError] = Choice::kOff;
  }
  const double phase = std::abs(*asked.orbital_rate_rad_s) *
                       to_seconds(screened.pass.fixes.back().fix.t - screened.pass.fixes.front().fix.t);
  if (is_open && phase > kLeastPhase) {
    const auto with = [&](const CalibrationOptions& options, double more, double at_least) {
      return with_orbital_drift(pass, screened, options, largest_model, progress, more - decision.log_likelihood,
                                at_least + kLogOddsToAccept);
    };
    std::optional<WithDrift> by_drift;
    if (at_orbit.may_be_drift()) {
      by_drift = with(without_error, at_orbit.more_for_drift(), 0);
    }
    const bool is_drift = by_drift && by_drift->counts;
    const double gain_of_drift = is_drift ? by_drift->gain : 0;
    if (at_orbit.may_be_both(at_orbit.has_error() || is_drift)) {
      WithDrift both = with(with_error, at_orbit.more_for_both(), gain_of_drift);
      if (both.counts) {
        both.decision.evidence.push_back({kDrift, both.gain - gain_of_drift, true});
        both.decision.moved_by_orbital_drift_rad = moved_from(decision, both.decision);
        return std::move(both).take(asked);
      }
    }
    if (is_drift) {
      by_drift->decision.evidence.push_back({kDrift, by_drift->gain, true});
      by_drift->decision.moved_by_orbital_drift_rad = moved_from(decision, by_drift->decision);
      by_drift->decision.orbital_error_over_drift =
          at_orbit.has_error() ? std::optional(-by_drift->gain) : std::nullopt;
      return (*std::move(by_drift)).take(asked);
    }
    if (by_drift && at_orbit.has_error()) {
      decision.orbital_error_over_drift = std::min(at_orbit.error_over_drift(), -by_drift->gain);
    }
  }
  if (!at_orbit.has_error() || at_orbit.error_over_drift() > -kLogOddsToAccept) {
    return decision;
  }
  Decision without = decide_by_pass(pass, screened, without_error, largest_model, progress);
  without.evidence.push_back({kError, at_orbit.error_over_drift(), false});
  without.orbital_error_over_drift = at_orbit.error_over_drift();
  without.field_or_error =
      field_or_error(pass, screened, asked, without, by_eq1_instead_of_field(pass, screened, asked, without));
  asked = without_error;
  return without_aberration(std::move(without));
}

void keep_what_comes_back(const Decision& before, Decision& again) {
  std::ranges::copy_if(before.evidence, std::back_inserter(again.evidence),
                       [](const Evidence& evidence) { return evidence.state == FurtherState::kOrbitalDrift; });
  again.orbital_error_over_drift = before.orbital_error_over_drift;
  again.moved_by_orbital_drift_rad = before.moved_by_orbital_drift_rad;
  again.orbital_error_over_field = before.orbital_error_over_field;
  again.field_or_error = before.field_or_error;
}

}  // namespace trihedron::ground
