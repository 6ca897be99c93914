#include "choose/polhodes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "choose/by_pass.hpp"
#include "choose/noise_search.hpp"
#include "choose/orbital_drift.hpp"
#include "choose/vertex.hpp"

namespace trihedron::ground {
namespace {

using Choice = FurtherStateOptions::Choice;

/// ln of the odds of the polhodes of all rotors together from which on they are tried.
constexpr double kLogOddsOfPolhode = 10;

/// The polhodes with which the pass is most likely by eq. (1), from those on that the changes of the coefficients show:
/// for each rotor the vertex of a parabola along turns and change in turn, with the random walk that is then likeliest.
/// What noise was found without them stands for a part of them, and goes as they are told better.
PerGyro<Polhode> most_likely_polhodes(const Pass& pass, const Screened& screened, CalibrationOptions options,
                                      PerGyro<Polhode> polhodes) {
  constexpr int kMostRounds = 6;
  constexpr double kNearEnough = 0.005;  // of a turn
  const double span_s = to_seconds(screened.pass.fixes.back().fix.t - pass.settings.epoch);
  const double least_walk = options.direction_random_walk_rad_sqrt_s;
  options.drift_field = false;
  options.drift_model = kEsg7;
  options.further_states[FurtherState::kPolhode] = Choice::kOn;
  options.further_states[FurtherState::kWanderingDrift] = Choice::kOff;
  options.further_states.polhodes = polhodes;
  std::optional<Trial> last;
  const auto fit = [&] {
    if (last) {
      last->release();
    }
    Trial trial(pass, screened, options, {}, last ? &*last : nullptr);
    last.emplace(std::move(trial));
    return last->log_likelihood();
  };
  double step = 0.05;  // of a turn
  for (int round = 0; round < kMostRounds && step > kNearEnough; ++round) {
    double most_moved = 0;  // in steps
    options.direction_random_walk_rad_sqrt_s = least_walk;
    fit();
    use_walk(with_most_likely_walk(*last, options).noise, options);
    double here = fit();
    for (std::size_t k = 0; k < pass.settings.gyros.size(); ++k) {
      Polhode& polhode = options.further_states.polhodes[static_cast<int>(k)];
      for (double TurnsOfPolhode::*along : {&TurnsOfPolhode::turns, &TurnsOfPolhode::change}) {
        const TurnsOfPolhode middle = TurnsOfPolhode::of(polhode, 0, span_s);
        const double size = along == &TurnsOfPolhode::turns ? step : 8 * step / middle.turns;
        const auto at = [&](double by) {
          TurnsOfPolhode moved = middle;
          moved.*along += by * size;
          polhode = moved.polhode(0, span_s);
          return fit();
        };
        const double before = at(-1);
        const double by = towards_vertex(before, here, at(1));
        if (const double there = at(by); there > here) {
          here = there;
          most_moved = std::max(most_moved, std::abs(by));
        } else {
          polhode = middle.polhode(0, span_s);
        }
      }
    }
    step /= most_moved < 1 ? 5 : 1;
  }
  return options.further_states.polhodes;
}

}  // namespace

Decision decide_on_polhodes(const Pass& pass, const Screened& screened, CalibrationOptions& asked,
                            const DriftModelId& largest_model, const Progress& progress) {
  constexpr FurtherState kPolhode = FurtherState::kPolhode;
  const bool is_open = asked.further_states[kPolhode] == Choice::kAuto;
  if (is_open) {
    asked.further_states[kPolhode] = Choice::kOff;
  }
  Decision decision = decide_on_orbital_drift(pass, screened, asked, largest_model, progress);
  double log_odds = 0;  // of those of all rotors
  for (const LikelyPolhode& likely : decision.polhodes) {
    log_odds += std::max(likely.log_odds, 0.0);
  }
  const bool is_likeliest = decision.changes.empty() || log_odds > decision.changes.front().log_odds;
  if (!is_open || log_odds < kLogOddsOfPolhode || !is_likeliest) {
    return decision;
  }
  begin_stage(progress, "looks for the polhodes of the rotors");
  PerGyro<Polhode> first;
  const auto likeliest = std::ranges::max_element(decision.polhodes, {}, &LikelyPolhode::log_odds);
  for (int k = 0; k < PerGyro<Polhode>::capacity(); ++k) {
    first[k] = (decision.polhodes[k].log_odds > 0 ? decision.polhodes[k] : *likeliest).polhode;
  }
  CalibrationOptions with = asked;
  with.further_states[kPolhode] = Choice::kOn;
  with.further_states.polhodes = most_likely_polhodes(pass, screened, decision.options, first);
  Decision by_polhodes = decide_by_pass(pass, screened, with, largest_model, progress);
  const double gain = by_polhodes.log_likelihood - decision.log_likelihood;
  if (gain <= kLogOddsToAccept || !is_all_that_is_left(by_polhodes)) {
    return decision;
  }
  keep_what_comes_back(decision, by_polhodes);
  by_polhodes.evidence.push_back({kPolhode, gain, true});
  asked = with;
  return by_polhodes;
}

}  // namespace trihedron::ground
