#include "model/orbital_rate.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include "model/scatter.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron::ground {

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
  if (!(rough_rad_s > 0.5 * kLowOrbit_rad_s)) {
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
