#include "trihedron/ground/clocks/clocks.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "clocks/turn_fit.hpp"
#include "clocks/turns.hpp"

namespace trihedron::ground {
namespace {

/// In sigmas: what is corrected, and a step that is told.
constexpr double kCertain = 6;

/// The rough offset by the fixes of a part of the pass, or by the others. A fit with a step converges from half a
/// second.
double rough_offset_s(const Pass& pass, const GyroReadings& readings, const Interval& part, bool in_it) {
  Pass fixes;
  fixes.settings = pass.settings;
  for (std::size_t i = 0; i < pass.star_tracker.size(); ++i) {
    if (part.has(pass.star_tracker.t[i]) == in_it) {
      fixes.star_tracker.t.push_back(pass.star_tracker.t[i]);
      fixes.star_tracker.q_in_c.push_back(pass.star_tracker.q_in_c[i]);
    }
  }
  constexpr double kFinest_s = 0.25;
  return rough_offset_s(fixes, readings, kFinest_s);
}

/// Clocks of a pass with a step that is suspected; nothing where it is none. The part that is fitted first may have
/// turns by both clocks, which gives a step that is too small: the next one is that by the step before. The rates
/// of the clocks are held there, since they would take up what a wrong part leaves.
std::optional<Clocks> clocks_with(Stepping stepping, const Pass& pass, const GyroReadings& readings, double offset_s) {
  constexpr int kMostRounds = 8;
  constexpr double kNearSigmas = 0.3;
  constexpr Duration kShortest = std::chrono::minutes(10);  // in one slew anything may have happened
  const double rest_s = rough_offset_s(pass, readings, stepping.part, false);
  double change_s = stepping.gyro < 0 ? rough_offset_s(pass, readings, stepping.part, true) - rest_s : 0;
  double begin_s = rest_s != 0 || change_s != 0 ? rest_s : offset_s;
  for (int round = 0; round < kMostRounds; ++round) {
    TurnFit fit(pass, readings, begin_s, stepping, change_s);
    if (round == 0) {
      fit.hold_rates();
    }
    if (!fit.converge()) {
      return std::nullopt;
    }
    const Measured change = fit.change();
    if (round > 0 && std::abs(change.value - change_s) < kNearSigmas * change.sigma) {
      const Duration part = stepping.part.until - stepping.part.from;
      const Duration shorter = std::min(part, pass.star_tracker.t.back() - pass.star_tracker.t.front() - part);
      if (!change.is_sure(kCertain) || shorter < kShortest) {
        return std::nullopt;
      }
      Clocks clocks = fit.clocks();
      clocks.step = {stepping.gyro, stepping.part.from, stepping.part.until, change};
      return clocks;
    }
    stepping.part = fit.part_with_step();
    begin_s = fit.clocks().mid_offset_s.value;
    change_s = change.value;
    // The rest is the part that holds the end of the pass.
    if (stepping.part.has(pass.star_tracker.t.back())) {
      stepping.part = {pass.star_tracker.t.front(), stepping.part.from};
      begin_s += stepping.gyro < 0 ? change_s : 0;
      change_s = -change_s;
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Clocks> clocks_of(const Pass& pass) {
  const GyroReadings readings(pass);
  constexpr Duration kSlowest = std::chrono::seconds(1);  // a slew bends within a few samples
  if (pass.settings.gyro_period > kSlowest || readings.gyros() < 2 || readings.size() < 2 ||
      pass.star_tracker.size() < kLeastPairs) {
    return std::nullopt;
  }
  constexpr double kFinest_s = 1;
  TurnFit fit(pass, readings, rough_offset_s(pass, readings, kFinest_s));
  if (!fit.converge()) {
    return std::nullopt;
  }
  if (const auto suspected = fit.suspected_step()) {
    if (const auto stepped = clocks_with(*suspected, pass, readings, fit.clocks().mid_offset_s.value)) {
      return stepped;
    }
  }
  return fit.clocks();
}

ClockCorrection correction_by(const Clocks& clocks, const PassSettings& settings) {
  // What is estimated as a state is linear in the offset: a tenth of a second bends a slew by 0.4″ at 0.02°/s².
  constexpr double kLeftToTheState_s = 0.1;
  constexpr double kLeastLate_s = 1e-3;
  ClockCorrection correction;
  const double change_s = clocks.rate_s_s.is_sure(kCertain) ? clocks.rate_s_s.value * to_seconds(settings.duration) : 0;
  const double farthest_s =
      std::max(std::abs(clocks.mid_offset_s.value - change_s / 2), std::abs(clocks.mid_offset_s.value + change_s / 2));
  if (farthest_s > kLeftToTheState_s && (change_s != 0 || clocks.mid_offset_s.is_sure(kCertain))) {
    correction.rate_s_s = change_s == 0 ? 0 : clocks.rate_s_s.value;
    // To a millisecond: what is less is for the state, and stamps that were on a grid mostly stay there.
    const double offset_s = change_s == 0 ? clocks.mid_offset_s.value : clocks.offset_s.value;
    correction.offset_s = std::round(1e3 * offset_s) / 1e3;
  }
  for (int k = 0; k < static_cast<int>(settings.gyros.size()); ++k) {
    const Measured& late = clocks.late_s[k];
    correction.late_s[k] = late.is_sure(kCertain) && std::abs(late.value) > kLeastLate_s ? late.value : 0;
  }
  return correction;
}

}  // namespace trihedron::ground
