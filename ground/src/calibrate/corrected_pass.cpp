#include "calibrate/corrected_pass.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibrate/correlated_fixes.hpp"
#include "calibrate/readout_noise.hpp"
#include "calibrate/restarted_gyro.hpp"
#include "trihedron/ground/clocks/regular_stamps.hpp"

namespace trihedron::ground {
namespace {

/// By how much the stamps of the gyros are late beside their scatter, s. What stamps that scatter are off in the mean
/// they do not tell, but those of the star tracker do, up to about as much as they scatter: the mean of a delay is √3
/// of its scatter where it is even, and as large as it where it is exponential. `pass`: with regular stamps.
double late_beside_scatter_s(const Pass& pass, double scatter_s) {
  constexpr double kSure = 5;
  constexpr double kLikeScatter = 2;
  const std::optional<Clocks> clocks = clocks_of(pass);
  const bool is_late =
      clocks && clocks->mid_offset_s.is_sure(kSure) && std::abs(clocks->mid_offset_s.value) < kLikeScatter * scatter_s;
  return is_late ? clocks->mid_offset_s.value : 0;
}

/// How much later after their stamps the fixes of further star trackers were taken than those of the first.
std::vector<Measured> further_star_trackers_s(const Pass& pass, const Measured& first_s) {
  std::vector<Measured> apart_s;
  Pass of_one;
  for (std::size_t i = 0; i < pass.further_star_trackers.size(); ++i) {
    if (i == 0) {
      of_one.settings = pass.settings;
      of_one.gyro = pass.gyro;
    }
    of_one.settings.star_tracker_noise_rad = pass.settings.further_star_trackers[i].noise_rad;
    of_one.star_tracker = pass.further_star_trackers[i];
    const std::optional<Clocks> its = clocks_of(of_one);
    apart_s.push_back(
        its ? Measured{its->mid_offset_s.value - first_s.value, std::hypot(its->mid_offset_s.sigma, first_s.sigma)}
            : Measured{});
  }
  return apart_s;
}

/// What is corrected before the calibration: what is switched off is not.
ClockCorrection wanted_correction(const Clocks& clocks, const PassSettings& settings,
                                  const CalibrationOptions& options) {
  ClockCorrection correction = correction_by(clocks, settings);
  if (options.further_states[FurtherState::kClockOffset] == FurtherStateOptions::Choice::kOff) {
    correction.offset_s = correction.rate_s_s = 0;
  }
  return correction;
}

/// A step that is taken off the stamps. Of several heads one may be the only one that steps, and which is not told.
std::optional<ClockStep> wanted_step(const Clocks& clocks, const Pass& pass, const CalibrationOptions& options) {
  const bool is_off = options.further_states[FurtherState::kClockOffset] == FurtherStateOptions::Choice::kOff;
  const bool of_star_tracker = clocks.step && clocks.step->gyro < 0;
  return of_star_tracker && (is_off || !pass.further_star_trackers.empty()) ? std::nullopt : clocks.step;
}

/// Adds states for what the correction of the stamps leaves of the star tracker's clock.
void add_clock_states(const ClockCorrection& correction, CalibrationOptions& options) {
  const auto turn_on = [&](FurtherState state, bool wanted) {
    FurtherStateOptions::Choice& choice = options.further_states[state];
    if (wanted && choice == FurtherStateOptions::Choice::kAuto && options.estimator != Estimator::kPaper) {
      choice = FurtherStateOptions::Choice::kOn;
    }
  };
  turn_on(FurtherState::kClockOffset, correction.of_star_tracker());
  turn_on(FurtherState::kClockRate, correction.rate_s_s != 0);
}

/// Makes estimates those of the telemetry as it was given.
void add_to_estimates(const ClockCorrection& correction, std::vector<FurtherEstimate>& estimates) {
  for (FurtherEstimate& estimate : estimates) {
    if (estimate.parameter.is_further(FurtherState::kClockOffset)) {
      estimate.value += correction.offset_s;
    } else if (estimate.parameter.is_further(FurtherState::kClockRate)) {
      estimate.value += correction.rate_s_s;
    }
  }
}

/// How far the stamps of the telemetry are off in all: what pass.toml says, what was corrected before the calibration,
/// and what the calibration found of the rest where it is sure of it. `further`: as add_to_estimates() leaves them.
std::optional<ClockCorrection> clocks_found(const PassSettings& settings, const ClockCorrection& corrected,
                                            const std::vector<FurtherEstimate>& further) {
  constexpr double kSure = 5;
  const auto is_clock = [](const FurtherEstimate& estimate) {
    return estimate.parameter.is_further(FurtherState::kClockOffset) ||
           estimate.parameter.is_further(FurtherState::kClockRate);
  };
  ClockCorrection found = corrected;
  // Offset and rate are correlated: both are taken where one of them is known to be there.
  if (std::ranges::any_of(further, [&](const FurtherEstimate& estimate) {
        return is_clock(estimate) && std::abs(estimate.value) >= kSure * estimate.sigma;
      })) {
    for (const FurtherEstimate& estimate : further) {
      if (estimate.parameter.is_further(FurtherState::kClockOffset)) {
        found.offset_s = estimate.value;
      } else if (estimate.parameter.is_further(FurtherState::kClockRate)) {
        found.rate_s_s = estimate.value;
      }
    }
  }
  found.offset_s += settings.star_tracker_clock_offset_s;
  found.rate_s_s += settings.star_tracker_clock_rate_s_s;
  for (std::size_t k = 0; k < std::min(settings.gyros.size(), std::size_t{kMaxGyros}); ++k) {
    found.late_s[static_cast<int>(k)] += settings.gyros[k].latency_s;
  }
  return found.of_star_tracker() || found.of_gyros() ? std::optional(found) : std::nullopt;
}

}  // namespace

CorrectedPass::CorrectedPass(const Pass& as_given, const CalibrationOptions& asked, StopRequest& stop_screening)
    : as_given_(as_given), options_(asked), stop_screening_(stop_screening) {
  make_stamps_regular();
  if (looks_for_noise(asked)) {
    leave_out_wrong_readings();
    take_readout_noise();
  }
  correct_clocks();
  refuse_restarted_gyro(pass());
  if (looks_for_noise(asked)) {
    leave_out_correlated_fixes();
  }
}

void CorrectedPass::replace_by(Pass corrected) {
  own_ = std::move(corrected);
  stop_screening_.make();
}

void CorrectedPass::make_stamps_regular() {
  std::optional<RegularStamps> regular = regular_stamps(pass());
  if (!regular) {
    return;
  }
  Pass its = pass();
  its.gyro.t = std::move(regular->t);
  gyro_stamps_off_s_ = regular->scatter_s;
  gyro_stamps_late_s_ = late_beside_scatter_s(its, regular->scatter_s);
  for (Time& t : its.gyro.t) {
    t -= from_seconds(gyro_stamps_late_s_);
  }
  replace_by(std::move(its));
}

void CorrectedPass::leave_out_wrong_readings() {
  const std::optional<WrongReadings> wrong = wrong_for_a_moment(pass());
  if (!wrong) {
    return;
  }
  std::optional<Pass> rest = without(*wrong, pass());
  bursts_ = wrong->bursts;
  bursts_->left_out = rest.has_value();
  if (rest) {
    replace_by(*std::move(rest));
  }
}

void CorrectedPass::take_readout_noise() {
  noise_ = other_readout_noise(pass());
  if (noise_) {
    replace_by(with(*noise_, pass()));
  }
}

void CorrectedPass::correct_clocks() {
  clocks_ = clocks_of(pass());
  if (!clocks_) {
    return;
  }
  step_ = wanted_step(*clocks_, pass(), options_);
  if (step_) {
    Pass without_step = pass();
    correct(without_step, *step_);
    replace_by(std::move(without_step));
    clocks_ = clocks_of(pass());
    if (!clocks_) {
      return;
    }
  }
  clocks_->further_star_trackers_s = further_star_trackers_s(pass(), clocks_->mid_offset_s);
  correction_ = wanted_correction(*clocks_, pass().settings, options_);
  if (correction_.of_star_tracker() || correction_.of_gyros()) {
    Pass corrected = pass();
    correct(corrected, correction_);
    replace_by(std::move(corrected));
    add_clock_states(correction_, options_);
  }
}

void CorrectedPass::leave_out_correlated_fixes() {
  correlated_ = correlated_fixes(pass());
  if (std::optional<Pass> rest = without(correlated_, pass())) {
    replace_by(*std::move(rest));
  }
}

void CorrectedPass::put_into(CalibrationRun& run) const {
  run.clocks = clocks_;
  run.corrected_step = step_;
  run.clock_correction = correction_;
  run.readout_noise = noise_;
  run.bursts = bursts_;
  run.gyro_stamps_off_s = gyro_stamps_off_s_;
  run.gyro_stamps_late_s = gyro_stamps_late_s_;
  run.correlated_fixes = correlated_;
  add_to_estimates(correction_, run.calibration.further);
  run.calibration.clocks = clocks_found(as_given_.settings, correction_, run.calibration.further);
}

}  // namespace trihedron::ground
