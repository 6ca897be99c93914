#include "model/orbital_rate.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include "model/scatter.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

/// Slower than a geostationary orbit, 7.3e-5 rad/s.
constexpr double kSlowest_rad_s = 6e-5;

/// Median of how fast the body turns over a minute, rad/s; 0 where there are no fixes for it.
double usual_rate_rad_s(const StarTrackerTelemetry& tracker) {
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
    const double rate = tracker.q_in_c[i].angularDistance(tracker.q_in_c[j]) / to_seconds(tracker.t[j] - tracker.t[i]);
    if (std::isfinite(rate)) {
      rates.push_back(rate);
    }
  }
  return rates.empty() ? 0 : median_of(rates);
}

}  // namespace

double orbital_rate_so_far_rad_s(const StarTrackerTelemetry& tracker) {
  constexpr double kLong_s = 2 * 3600;  // of it the mean over half is told
  if (tracker.size() > 0 && to_seconds(tracker.t.back() - tracker.t.front()) > kLong_s) {
    return orbital_rate_rad_s(tracker);
  }
  const double usual_rad_s = usual_rate_rad_s(tracker);
  return usual_rad_s > kSlowest_rad_s ? usual_rad_s : kLowOrbit_rad_s;
}

double orbital_rate_rad_s(const StarTrackerTelemetry& tracker) {
  constexpr double kFastest_rad_s = 0.02;  // beyond, an outlier
  // The mean angular velocity in `in`: a slew and the slew back nearly cancel.
  Eigen::Vector3d turned = Eigen::Vector3d::Zero();
  double time_s = 0;
  for (std::size_t i = 1; i < tracker.size(); ++i) {
    const double step_s = to_seconds(tracker.t[i] - tracker.t[i - 1]);
    const auto before = Rot<In, C>::assume(tracker.q_in_c[i - 1].normalized());
    const auto after = Rot<In, C>::assume(tracker.q_in_c[i].normalized());
    const Eigen::Vector3d turn = (after * before.inverse()).log().raw();
    if (step_s < 60 && turn.norm() < kFastest_rad_s * step_s) {
      turned += turn;
      time_s += step_s;
    }
  }
  const double rough_rad_s = time_s > 0 ? turned.norm() / time_s : 0;
  // Slower orbits are told from an attitude that is fixed in space between slews by what it does at most times.
  constexpr double kSteady = 0.1;
  const bool is_steady = std::abs(usual_rate_rad_s(tracker) - rough_rad_s) < kSteady * rough_rad_s;
  if (!(rough_rad_s > 0.5 * kLowOrbit_rad_s || (is_steady && rough_rad_s > kSlowest_rad_s))) {
    return kLowOrbit_rad_s;
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
  if (rates.empty()) {
    return rough_rad_s;
  }
  return median_of(rates);
}

}  // namespace trihedron::ground
