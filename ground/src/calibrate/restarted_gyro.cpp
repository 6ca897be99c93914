#include "calibrate/restarted_gyro.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "clocks/turns.hpp"
#include "model/scatter.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Vector3d;

/// Indices of two gyros.
using PairOfGyros = std::array<int, 2>;

/// The momenta of a pair at a fix, by readings and alignments known before.
struct MomentaAtFix {
  Time t{};
  Eigen::Quaterniond q_in_c;
  std::array<Vector3d, 2> h_in;
};

double angle_rad(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

std::vector<MomentaAtFix> momenta_at_fixes(const Pass& pass, const PairOfGyros& pair) {
  const StarTrackerTelemetry& fixes = pass.star_tracker;
  const GyroReadings readings(pass);
  std::vector<MomentaAtFix> all;
  std::size_t after = 0;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    while (after < pass.gyro.size() && pass.gyro.t[after] < fixes.t[i]) {
      ++after;
    }
    if (after == pass.gyro.size() || pass.gyro.t[after] - fixes.t[i] > pass.settings.gyro_period ||
        !nearly_unit(fixes.q_in_c[i].norm())) {
      continue;
    }
    const Eigen::Quaterniond q_in_c = fixes.q_in_c[i].normalized();
    const std::optional<Vector3d> first = readings.reading(after, pair[0]);
    const std::optional<Vector3d> second = readings.reading(after, pair[1]);
    if (first && second) {
      all.push_back({fixes.t[i], q_in_c, {q_in_c * *first, q_in_c * *second}});
    }
  }
  return all;
}

/// Component by component. `gyro`: of the pair, as in all below.
Vector3d median_momentum(const std::vector<MomentaAtFix>& all, std::size_t from, std::size_t until, std::size_t gyro) {
  Vector3d h_in;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (std::size_t i = from; i < until; ++i) {
      values.push_back(all[i].h_in[gyro](axis));
    }
    h_in(axis) = median_of(values);
  }
  return h_in;
}

constexpr std::size_t kFixesBeside = 20;  ///< to each side of a jump
constexpr Duration kLongestBeside = std::chrono::hours(1);

/// By what a momentum may turn in `in`, or seem to.
struct MayTurn {
  double alignment_rad = 0;  ///< not known yet, where the body turns
  double drift_rad_s = 0;
};

MayTurn may_turn_of(const PassSettings& settings) {
  constexpr double kSigmas = 3;
  MayTurn may_turn;
  for (const GyroPrior& gyro : settings.gyros) {
    may_turn.alignment_rad = std::max(may_turn.alignment_rad, kSigmas * gyro.alignment_sigma_rad.maxCoeff());
    may_turn.drift_rad_s = std::max(may_turn.drift_rad_s, kSigmas * gyro.drift_common_sigma_rad_s);
    for (const auto& [coefficient, sigma_rad_s] : gyro.drift_sigma_rad_s) {
      may_turn.drift_rad_s = std::max(may_turn.drift_rad_s, kSigmas * sigma_rad_s);
    }
  }
  return may_turn;
}

constexpr double kLeastJump_rad = 0.0175;

/// How far a momentum may turn before a fix, between the fixes before it and after.
double jump_limit_rad(const MayTurn& may_turn, const std::vector<MomentaAtFix>& all, std::size_t fix) {
  const double turn_rad = all[fix - 1].q_in_c.angularDistance(all[fix].q_in_c);
  const Duration apart = all[fix + kFixesBeside / 2].t - all[fix - kFixesBeside / 2].t;
  return kLeastJump_rad + 2 * may_turn.alignment_rad * std::min(1.0, turn_rad) +
         may_turn.drift_rad_s * to_seconds(apart);
}

struct JumpOfMomentum {
  std::size_t fix = 0;  ///< before which it is
  std::size_t gyro = 0;
  double turned_rad = 0;
};

/// Whether a momentum stays in its direction for an hour to either side of a jump, and is not where it was before for
/// an hour after, nor where it is after for an hour before; ten minutes of each have to be there. One that does not
/// stay is none: readings that do not change, or are of other axes, turn with the body.
bool turns_for_good(const std::vector<MomentaAtFix>& all, const JumpOfMomentum& jump, const MayTurn& may_turn) {
  constexpr Duration kLeast = std::chrono::minutes(10);
  constexpr std::size_t kOneIn = 100;  // may be an outlier
  const double stays_rad =
      kLeastJump_rad + 2 * may_turn.alignment_rad + may_turn.drift_rad_s * to_seconds(kLongestBeside);
  const std::size_t fix = jump.fix;
  const auto count_near = [&](const Vector3d& at, double within_rad, std::size_t from, std::size_t until) {
    std::size_t there = 0;
    for (std::size_t i = from; i < until; ++i) {
      there += angle_rad(all[i].h_in[jump.gyro], at) < within_rad ? 1 : 0;
    }
    return there;
  };
  std::size_t from = fix;
  while (from > 0 && all[fix].t - all[from - 1].t < kLongestBeside) {
    --from;
  }
  std::size_t until = fix;
  while (until < all.size() && all[until].t - all[fix].t < kLongestBeside) {
    ++until;
  }
  if (all[until - 1].t - all[fix].t < kLeast || from == fix || all[fix - 1].t - all[from].t < kLeast) {
    return false;
  }
  const Vector3d before = median_momentum(all, fix - kFixesBeside, fix, jump.gyro);
  const Vector3d after = median_momentum(all, fix, fix + kFixesBeside, jump.gyro);
  return kOneIn * count_near(before, jump.turned_rad / 2, fix, until) <= until - fix &&
         kOneIn * count_near(after, jump.turned_rad / 2, from, fix) <= fix - from &&
         2 * count_near(before, stays_rad, from, fix) > fix - from &&
         2 * count_near(after, stays_rad, fix, until) > until - fix;
}

/// Of one momentum before a fix, by more than the limit, while the other turns by less than half of it and the angle
/// between these two, which no attitude and no stamp changes, is another.
std::optional<JumpOfMomentum> jump_before(const std::vector<MomentaAtFix>& all, std::size_t fix,
                                          const MayTurn& may_turn) {
  const double limit = jump_limit_rad(may_turn, all, fix);
  if (angle_rad(all[fix - 1].h_in[0], all[fix].h_in[0]) < limit &&
      angle_rad(all[fix - 1].h_in[1], all[fix].h_in[1]) < limit) {
    return std::nullopt;
  }
  std::array<Vector3d, 2> before;
  std::array<Vector3d, 2> after;
  std::array<double, 2> turned_rad{};
  for (const std::size_t k : {0U, 1U}) {
    before[k] = median_momentum(all, fix - kFixesBeside, fix, k);
    after[k] = median_momentum(all, fix, fix + kFixesBeside, k);
    turned_rad[k] = angle_rad(before[k], after[k]);
  }
  const std::size_t gyro = turned_rad[1] > turned_rad[0] ? 1 : 0;
  const double opened_rad = angle_rad(after[0], after[1]) - angle_rad(before[0], before[1]);
  const bool is_alone = turned_rad[1 - gyro] < limit / 2 && std::abs(opened_rad) > limit / 4;
  return is_alone && turned_rad[gyro] > limit ? std::optional(JumpOfMomentum{fix, gyro, turned_rad[gyro]})
                                              : std::nullopt;
}

std::optional<JumpOfMomentum> jump_for_good(const std::vector<MomentaAtFix>& all, const MayTurn& may_turn) {
  for (std::size_t i = kFixesBeside; i + kFixesBeside < all.size(); ++i) {
    const std::optional<JumpOfMomentum> jump = jump_before(all, i, may_turn);
    if (jump && turns_for_good(all, *jump, may_turn)) {
      return jump;
    }
  }
  return std::nullopt;
}

SetupError error_of_restart(const PassSettings& settings, int gyro, double turned_rad, Time last, Time first) {
  using std::chrono::seconds;
  const bool is_reversed = turned_rad > std::numbers::pi - kLeastJump_rad;
  return {fmt::format("the momentum of gyro {} turns by {:.1f} deg between t = {:.0f} s and {:.0f} s, and stays there: "
                      "as of {}",
                      gyro + 1, turned_rad * 180 / std::numbers::pi, to_seconds(last - settings.epoch),
                      to_seconds(first - settings.epoch),
                      is_reversed ? "readings that are given with another sign from then on"
                                  : "a rotor that was started anew, whose coefficients are others then"),
          fmt::format("calibrate the parts apart: cut them out by \"trihedron import PASS --to {} -o BEFORE\" and "
                      "\"trihedron import PASS --from {} -o AFTER\"",
                      iso_time(std::chrono::floor<seconds>(last)), iso_time(std::chrono::ceil<seconds>(first)))};
}

}  // namespace

void refuse_restarted_gyro(const Pass& pass) {
  const MayTurn may_turn = may_turn_of(pass.settings);
  const int gyros = GyroReadings(pass).gyros();
  for (int first = 0; first < gyros; ++first) {
    for (int second = first + 1; second < gyros; ++second) {
      const PairOfGyros pair{first, second};
      const std::vector<MomentaAtFix> all = momenta_at_fixes(pass, pair);
      if (const auto jump = jump_for_good(all, may_turn)) {
        throw error_of_restart(pass.settings, pair[jump->gyro], jump->turned_rad, all[jump->fix - 1].t,
                               all[jump->fix].t);
      }
    }
  }
}

}  // namespace trihedron::ground
