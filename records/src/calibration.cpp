#include "trihedron/records/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trihedron {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

}  // namespace

OrbitalDrift OrbitalDrift::from(Time zero) const {
  const double sine = std::sin(phase(zero));
  const double cosine = std::cos(phase(zero));
  return {cosine * sine_rad_s - sine * cosine_rad_s, sine * sine_rad_s + cosine * cosine_rad_s, rate_rad_s, zero};
}

PolhodeDrift PolhodeDrift::from(Time zero) const {
  const double sine = std::sin(angle_rad(zero));
  const double cosine = std::cos(angle_rad(zero));
  return {polhode.after(to_seconds(zero - zero_at)), zero, cosine * sine_rad_s - sine * cosine_rad_s,
          sine * sine_rad_s + cosine * cosine_rad_s};
}

double value_of(const Calibration& calibration, const ParameterId& state) {
  if (state.gyro() >= calibration.gyros.size() || state.kind == ParameterId::Kind::kFurtherState) {
    return kNone;
  }
  const GyroCalibration& gyro = calibration.gyros[state.gyro()];
  if (state.is_alignment()) {
    return gyro.alignment_rotation_vector_rad(state.component);
  }
  const std::vector<DriftCoefficient> coefficients = coefficients_of(gyro.drift_model);
  const auto found = std::ranges::find(coefficients, state.coefficient);
  const auto index = static_cast<std::size_t>(found - coefficients.begin());
  return index < gyro.drift_rad_s.size() && found != coefficients.end() ? gyro.drift_rad_s[index] : kNone;
}

std::vector<Eigen::Index> rows_of(const Calibration& calibration, const std::vector<ParameterId>& states) {
  std::vector<Eigen::Index> rows;
  rows.reserve(states.size());
  for (const ParameterId& state : states) {
    rows.push_back(std::ranges::find(calibration.states, state) - calibration.states.begin());
  }
  return rows;
}

double sigma_of(const Calibration& calibration, const ParameterId& state) {
  const Eigen::Index row = rows_of(calibration, {state}).front();
  return row < calibration.covariance.rows() ? std::sqrt(calibration.covariance(row, row)) : kNone;
}

}  // namespace trihedron
