#include "choose/polhode_search.hpp"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "trihedron/records/stop.hpp"

namespace trihedron::ground {

using Eigen::Index;
using Eigen::VectorXd;

TurnsOfPolhode TurnsOfPolhode::of(const Polhode& polhode, double begin_s, double span_s) {
  const double turns = span_s / static_cast<double>(polhode.after(begin_s + span_s / 2).period_s);
  return {turns, static_cast<double>(polhode.period_rate) * turns};
}

Polhode TurnsOfPolhode::polhode(double begin_s, double span_s) const {
  const double rate = change / turns;
  return {static_cast<float>(span_s / turns - rate * (begin_s + span_s / 2)), static_cast<float>(rate)};
}

PolhodeSearch::PolhodeSearch(const PassForm& pass, const PassProblem& problem, VectorXd sigma)
    : pass_(pass),
      zero_at_(problem.setup().on_board.orbital_phase_zero),
      begin_s_(to_seconds(pass.middle(0) - zero_at_)),
      span_s_(to_seconds(pass.middle(pass.steps()) - pass.middle(0))),
      sigma_(std::move(sigma)) {}

LikelyPolhode PolhodeSearch::of_gyro(int gyro) const {
  constexpr double kStep = 0.25;         // of a turn: at the ends the angle is off by 23° at most
  constexpr double kStretchesATurn = 4;  // at least
  constexpr double kMostChange = 0.4;    // of the period, over the pass
  constexpr double kLeastTurns = 1.5;    // less looks like a warm-up or a jump
  constexpr double kWorthMore = 3;       // ln of the odds
  TurnsOfPolhode best{kLeastTurns, 0};
  double best_log_odds = -std::numeric_limits<double>::infinity();
  const auto consider = [&](double turns, double change) {
    check_stop();
    const bool is_one = turns >= kLeastTurns && std::abs(change) <= kMostChange;
    const double odds = is_one ? log_odds(gyro, {turns, change}) : best_log_odds;
    const bool is_better = odds > best_log_odds;
    if (is_better) {
      best = {turns, change};
      best_log_odds = odds;
    }
    return is_better;
  };
  const double most = static_cast<double>(pass_.steps() + 1) / kStretchesATurn;
  int tries = 0;  // those from here on are about the same polhode
  for (; kLeastTurns + kStep * tries <= most; ++tries) {
    consider(kLeastTurns + kStep * tries, 0);
  }
  if (best_log_odds - std::log(tries) > kWorthMore) {
    const TurnsOfPolhode first = best;
    for (const double change : {-0.4, -0.3, -0.2, -0.1, 0.1, 0.2, 0.3, 0.4}) {
      for (const double turns : {first.turns - kStep, first.turns, first.turns + kStep}) {
        consider(turns, change);
      }
    }
    for (double step = kStep / 2; step > 1e-3;) {
      const TurnsOfPolhode at = best;
      const bool is_better = consider(at.turns - step, at.change) || consider(at.turns + step, at.change) ||
                             consider(at.turns, at.change - step / 2) || consider(at.turns, at.change + step / 2);
      step /= is_better ? 1 : 2;
    }
  }
  return {best.polhode(begin_s_, span_s_), best_log_odds - std::log(tries)};
}

double PolhodeSearch::log_odds(int gyro, const TurnsOfPolhode& turns) const {
  const Polhode its = turns.polhode(begin_s_, span_s_);
  const auto angle = [&](Index stretch) { return its.angle_rad(to_seconds(pass_.middle(stretch) - zero_at_)); };
  std::vector<Eigen::Triplet<double>> entries;
  for (Index step = 0; step < pass_.steps(); ++step) {
    const double from = angle(step);
    const double to = angle(step + 1);
    for (int i = 0; i < Layout::kEq1; ++i) {
      entries.emplace_back(pass_.parameter(step, gyro, i), i, std::sin(to) - std::sin(from));
      entries.emplace_back(pass_.parameter(step, gyro, i), Layout::kEq1 + i, std::cos(to) - std::cos(from));
    }
  }
  Eigen::SparseMatrix<double> columns(pass_.size(), Layout::kPolhode);
  columns.setFromTriplets(entries.begin(), entries.end());
  Change its_odds;
  pass_.put_into(its_odds, columns, sigma_.segment<Layout::kEq1>(Index{Layout::kEq1} * gyro).replicate(2, 1),
                 std::numeric_limits<double>::infinity());
  return its_odds.log_odds;
}

}  // namespace trihedron::ground
