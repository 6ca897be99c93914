#include "calibrate/restarted_gyro.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "clocks/turns.hpp"
#include "model/scatter.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Vector3d;

/// The momenta at a fix, by readings and alignments known before.
struct MomentaAtFix {
  Time t{};
  Eigen::Quaterniond q_in_c;
  PerGyro<Vector3d> h_in;
};

double angle_rad(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

std::vector<MomentaAtFix> momenta_at_fixes(const Pass& pass) {
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
    if (const auto h_c = readings.sample(after)) {
      MomentaAtFix& its = all.emplace_back(MomentaAtFix{fixes.t[i], q_in_c, {}});
      for (int k = 0; k < pass.gyro.gyros; ++k) {
        its.h_in[k] = q_in_c * (*h_c)[k];
      }
    }
  }
  return all;
}

/// Component by component.
Vector3d median_momentum(const std::vector<MomentaAtFix>& all, std::size_t from, std::size_t until, int gyro) {
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

/// Whether a momentum that turns by this angle before a fix is not where it was before for an hour after, nor where it
/// is after for an hour before; ten minutes of each have to be there.
bool turns_for_good(const std::vector<MomentaAtFix>& all, std::size_t fix, int gyro, double turned_rad) {
  constexpr Duration kLongest = std::chrono::hours(1);
  constexpr Duration kLeast = std::chrono::minutes(10);
  constexpr std::size_t kOneIn = 100;  // may be an outlier
  const auto is_never = [&](const Vector3d& at, std::size_t from, std::size_t until) {
    std::size_t there = 0;
    for (std::size_t i = from; i < until; ++i) {
      there += angle_rad(all[i].h_in[gyro], at) < turned_rad / 2 ? 1 : 0;
    }
    return all[until - 1].t - all[from].t >= kLeast && kOneIn * there <= until - from;
  };
  std::size_t from = fix;
  while (from > 0 && all[fix].t - all[from - 1].t < kLongest) {
    --from;
  }
  std::size_t until = fix;
  while (until < all.size() && all[until].t - all[fix].t < kLongest) {
    ++until;
  }
  return is_never(median_momentum(all, fix - kFixesBeside, fix, gyro), fix, until) &&
         is_never(median_momentum(all, fix, fix + kFixesBeside, gyro), from, fix);
}

struct Jump {
  int gyro = 0;
  double turned_rad = 0;
};

/// Of one momentum before a fix, by more than the limit, while another turns by less than half of it and the angle
/// between these two, which no attitude and no stamp changes, is another.
std::optional<Jump> jump_before(const std::vector<MomentaAtFix>& all, std::size_t fix, int gyros, double limit_rad) {
  bool seems_to = false;
  for (int k = 0; k < gyros; ++k) {
    seems_to = seems_to || angle_rad(all[fix - 1].h_in[k], all[fix].h_in[k]) > limit_rad;
  }
  if (!seems_to) {
    return std::nullopt;
  }
  Jump jump;
  PerGyro<double> turned_rad{};
  PerGyro<Vector3d> before;
  PerGyro<Vector3d> after;
  for (int k = 0; k < gyros; ++k) {
    before[k] = median_momentum(all, fix - kFixesBeside, fix, k);
    after[k] = median_momentum(all, fix, fix + kFixesBeside, k);
    turned_rad[k] = angle_rad(before[k], after[k]);
    jump = turned_rad[k] > jump.turned_rad ? Jump{k, turned_rad[k]} : jump;
  }
  bool is_alone = false;
  for (int k = 0; k < gyros; ++k) {
    const double opened_rad = angle_rad(after[jump.gyro], after[k]) - angle_rad(before[jump.gyro], before[k]);
    is_alone = is_alone || (turned_rad[k] < limit_rad / 2 && std::abs(opened_rad) > limit_rad / 4);
  }
  return is_alone && jump.turned_rad > limit_rad ? std::optional(jump) : std::nullopt;
}

}  // namespace

void refuse_restarted_gyro(const Pass& pass) {
  constexpr double kLeastJump_rad = 0.0175;
  constexpr double kSigmas = 3;
  const std::vector<MomentaAtFix> all = momenta_at_fixes(pass);
  double alignment_rad = 0;
  for (const GyroPrior& gyro : pass.settings.gyros) {
    alignment_rad = std::max(alignment_rad, kSigmas * gyro.alignment_sigma_rad.maxCoeff());
  }
  for (std::size_t i = kFixesBeside; i + kFixesBeside < all.size(); ++i) {
    // What alignments that are not known yet make of a turn of the body.
    const double turn_rad = all[i - 1].q_in_c.angularDistance(all[i].q_in_c);
    const double limit_rad = kLeastJump_rad + 2 * alignment_rad * std::min(1.0, turn_rad);
    const auto jump = jump_before(all, i, pass.gyro.gyros, limit_rad);
    if (jump && turns_for_good(all, i, jump->gyro, jump->turned_rad)) {
      const double last_s = to_seconds(all[i - 1].t - pass.settings.epoch);
      const double first_s = to_seconds(all[i].t - pass.settings.epoch);
      throw SetupError(
          fmt::format(
              "the momentum of gyro {} turns by {:.1f} deg between t = {:.0f} s and {:.0f} s, and stays there: as "
              "of a rotor that was started anew, whose coefficients are others then",
              jump->gyro + 1, jump->turned_rad * 180 / std::numbers::pi, last_s, first_s),
          fmt::format("calibrate the parts apart: with --to {:.0f}s, and with --from {:.0f}s", last_s, first_s));
    }
  }
}

}  // namespace trihedron::ground
