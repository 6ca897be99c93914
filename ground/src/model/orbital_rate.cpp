#include "model/orbital_rate.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "model/scatter.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

/// Slower than a geostationary orbit, 7.3e-5 rad/s.
constexpr double kSlowest_rad_s = 6e-5;

/// Of an orbit as low as the ground, the root of GM/R³.
constexpr double kFastest_rad_s = 1.24e-3;

/// How the body usually turns in `in`.
struct UsualTurn {
  Eigen::Vector3d rate_rad_s;
  double sigma_rad_s;  ///< by the scatter over the pass
};

/// Median of the angular velocity over a minute, component by component: slews there and back lie to both sides of it.
/// Nothing where there are no fixes for it.
std::optional<UsualTurn> usual_turn(const StarTrackerTelemetry& tracker) {
  constexpr double kApart_s = 60;
  std::vector<double> rates;
  std::size_t j = 0;
  for (std::size_t i = 0; i < tracker.size(); ++i) {
    while (j < tracker.size() && to_seconds(tracker.t[j] - tracker.t[i]) < kApart_s) {
      ++j;
    }
    if (j == tracker.size()) {
      break;
    }
    const auto before = Rot<In, C>::assume(tracker.q_in_c[i].normalized());
    const auto after = Rot<In, C>::assume(tracker.q_in_c[j].normalized());
    const Eigen::Vector3d rate = (after * before.inverse()).log().raw() / to_seconds(tracker.t[j] - tracker.t[i]);
    if (rate.allFinite()) {
      rates.insert(rates.end(), rate.begin(), rate.end());
    }
  }
  if (rates.empty()) {
    return std::nullopt;
  }
  const auto columns = Eigen::Matrix3Xd::Map(rates.data(), 3, std::ssize(rates) / 3);
  UsualTurn usual{.rate_rad_s = medians_of(columns), .sigma_rad_s = 0};
  const Eigen::ArrayXd off_rad_s = (columns.colwise() - usual.rate_rad_s).colwise().norm();
  std::vector<double> sizes(off_rad_s.begin(), off_rad_s.end());
  const double minutes = to_seconds(tracker.t.back() - tracker.t.front()) / kApart_s;
  usual.sigma_rad_s = median_of(sizes) / std::sqrt(std::max(minutes, 1.0));
  return usual;
}

bool is_of_an_orbit(double rate_rad_s) {
  return std::abs(rate_rad_s) > kSlowest_rad_s && std::abs(rate_rad_s) < kFastest_rad_s;
}

}  // namespace

std::optional<double> orbital_rate_so_far_rad_s(const StarTrackerTelemetry& tracker) {
  constexpr double kWellEnough = 0.03;                        // over a short time the phase is off by little
  constexpr Duration kEnoughOfSlews = std::chrono::hours(1);  // their mean is known to some hundredths
  const Duration passed = tracker.size() > 0 ? tracker.t.back() - tracker.t.front() : Duration::zero();
  if (passed > kLongForOrbitalRate) {
    return shown_orbital_rate_rad_s(tracker);
  }
  const std::optional<UsualTurn> usual = usual_turn(tracker);
  const double rate_rad_s = usual ? usual->rate_rad_s.norm() : 0;
  if (usual && is_of_an_orbit(rate_rad_s) && usual->sigma_rad_s < kWellEnough * rate_rad_s) {
    return rate_rad_s;
  }
  const bool slews_mostly = usual && usual->sigma_rad_s > kWellEnough * kLowOrbit_rad_s;
  return slews_mostly && passed > kEnoughOfSlews ? shown_orbital_rate_rad_s(tracker) : std::nullopt;
}

double orbital_rate_rad_s(const StarTrackerTelemetry& tracker) {
  return shown_orbital_rate_rad_s(tracker).value_or(kLowOrbit_rad_s);
}

std::optional<double> shown_orbital_rate_rad_s(const StarTrackerTelemetry& tracker) {
  constexpr double kFastestSlew_rad_s = 0.02;  // beyond, an outlier
  if (tracker.size() < 2) {
    return std::nullopt;
  }
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < tracker.size(); ++i) {
    steps_s.push_back(to_seconds(tracker.t[i] - tracker.t[i - 1]));
  }
  const double longest_step_s = std::clamp(2 * median_of(steps_s), 60.0, 600.0);
  // The mean angular velocity in `in`: a slew and the slew back nearly cancel.
  Eigen::Vector3d turned = Eigen::Vector3d::Zero();
  double time_s = 0;
  for (std::size_t i = 1; i < tracker.size(); ++i) {
    const double step_s = to_seconds(tracker.t[i] - tracker.t[i - 1]);
    const auto before = Rot<In, C>::assume(tracker.q_in_c[i - 1].normalized());
    const auto after = Rot<In, C>::assume(tracker.q_in_c[i].normalized());
    const Eigen::Vector3d turn = (after * before.inverse()).log().raw();
    if (step_s < longest_step_s && turn.norm() < kFastestSlew_rad_s * step_s) {
      turned += turn;
      time_s += step_s;
    }
  }
  const double rough_rad_s = time_s > 0 ? turned.norm() / time_s : 0;
  // Slower orbits are told from an attitude that is fixed in space between slews by what it does at most times.
  constexpr double kSteady = 0.1;
  const std::optional<UsualTurn> usual = usual_turn(tracker);
  const bool is_steady = usual && (usual->rate_rad_s - turned / time_s).norm() < kSteady * rough_rad_s;
  if (!(rough_rad_s > 0.5 * kLowOrbit_rad_s || (is_steady && rough_rad_s > kSlowest_rad_s))) {
    return std::nullopt;
  }
  // Refined, and robust by the median against outliers and slews: the turn about that axis over half of the pass.
  const Eigen::Vector3d axis = turned.normalized();
  const std::size_t half = tracker.size() / 2;
  std::vector<double> rates;
  for (std::size_t i = 0; i + half < tracker.size(); ++i) {
    const Eigen::Quaterniond turn = tracker.q_in_c[i + half] * tracker.q_in_c[i].conjugate();
    const double span_s = to_seconds(tracker.t[i + half] - tracker.t[i]);
    const double twist = 2 * std::atan2(turn.vec().dot(axis), turn.w());
    const double revolutions = std::round((rough_rad_s * span_s - twist) / (2 * std::numbers::pi));
    const double rate = (twist + 2 * std::numbers::pi * revolutions) / span_s;
    if (std::isfinite(rate)) {
      rates.push_back(rate);
    }
  }
  // What turns faster than any orbit does spins.
  const double rate_rad_s = rates.empty() ? rough_rad_s : median_of(rates);
  return is_of_an_orbit(rate_rad_s) ? std::optional(rate_rad_s) : std::nullopt;
}

}  // namespace trihedron::ground
