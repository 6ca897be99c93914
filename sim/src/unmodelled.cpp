#include "trihedron/sim/unmodelled.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "trihedron/sim/precession.hpp"

namespace trihedron::sim {
namespace {

using Eigen::Vector3d;

/// Nodes and weights of Gauss and Legendre over −1 … 1 by Newton's method from Chebyshev's nodes (Press et al.,
/// Numerical Recipes, 4.6).
constexpr int kNodes = 64;
std::array<std::pair<double, double>, kNodes> gauss_legendre() {
  std::array<std::pair<double, double>, kNodes> rule;
  for (int i = 0; i < kNodes; ++i) {
    double z = std::cos(std::numbers::pi * (i + 0.75) / (kNodes + 0.5));
    double slope = 0;
    for (int round = 0; round < 8; ++round) {
      double p = 1;
      double before = 0;
      for (int k = 0; k < kNodes; ++k) {
        const double next = ((2 * k + 1) * z * p - k * before) / (k + 1);
        before = p;
        p = next;
      }
      slope = kNodes * (z * p - before) / (z * z - 1);
      z -= p / slope;
    }
    rule[static_cast<std::size_t>(i)] = {z, 2 / ((1 - z * z) * slope * slope)};
  }
  return rule;
}

}  // namespace

DriftBump::DriftBump(double amplitude_rad_s, const Vector3d& centre, double radius_rad)
    : centre_(centre.normalized()), depth_(1 - std::cos(radius_rad)) {
  if (!(centre.norm() > 0)) {
    throw std::invalid_argument("drift bump: the centre must have a length");
  }
  if (!(radius_rad > 0 && radius_rad <= std::numbers::pi / 2)) {
    throw std::invalid_argument("drift bump: the radius must be positive and at most 90 degrees");
  }
  // |ω| ∝ (1 − u)² sin θ, largest where 3 cos² θ − cos radius cos θ − 2 = 0; √2 of the two parts at right angles.
  const double edge = std::cos(radius_rad);
  const double cosine = (edge + std::sqrt(edge * edge + 24)) / 6;
  const double inside = 1 - (1 - cosine) / depth_;
  scale_rad_s_ = amplitude_rad_s / (std::numbers::sqrt2 * inside * inside * std::sqrt(1 - cosine * cosine));
}

DriftHysteresis::DriftHysteresis(double amplitude_rad_s, double width_rad)
    : width_rad_(width_rad), scale_rad_s_(amplitude_rad_s / std::sin(width_rad)) {
  if (!(width_rad > 0 && width_rad <= std::numbers::pi / 2)) {
    throw std::invalid_argument("drift hysteresis: the width must be positive and at most 90 degrees");
  }
}

void DriftHysteresis::move_to(const Vector3d& h) {
  if (follower_.isZero(0)) {
    follower_ = h;
    return;
  }
  const Vector3d axis = follower_.cross(h);
  const double angle = std::atan2(axis.norm(), follower_.dot(h));
  if (angle > width_rad_) {
    follower_ = rotated<double>(axis.normalized() * (angle - width_rad_), follower_).normalized();
  }
}

void DriftModulation::next_step(double t_s, double step_s, const Flight& flight) {
  since_slew_ = flight.body_rate_rad_s > kSlewRate_rad_s ? 1 : since_slew_ * std::exp(-step_s / scenario_.slew_time_s);
  const double kept = std::exp(-step_s / scenario_.thermal_time_s);
  warmth_ = kept * warmth_ + (1 - kept) * (flight.sunlit ? 1 : 0);
  // The phase is 2π ∫ dt / (period + rate t).
  const double relative = scenario_.polhode_period_rate * t_s / scenario_.polhode_period_s;
  const double turns = t_s / scenario_.polhode_period_s * (relative == 0 ? 1 : std::log1p(relative) / relative);
  const double but_polhode = scenario_.slew_fraction * since_slew_ + scenario_.thermal_fraction * (2 * warmth_ - 1);
  now_ = but_polhode + scenario_.polhode_fraction * std::cos(phase_rad_ + 2 * std::numbers::pi * turns);
  sum_s_ += but_polhode * step_s;
  time_s_ += step_s;
}

Esg7::Coefficients<double> part_in_eq1(const std::function<Vector3d(const Vector3d&)>& rate_rad_s) {
  constexpr int kMeridians = 128;
  Eigen::Matrix<double, Esg7::kSize, Esg7::kSize> square = decltype(square)::Zero();
  Esg7::Coefficients<double> product = Esg7::Coefficients<double>::Zero();
  for (const auto& [z, weight] : gauss_legendre()) {
    const double r = std::sqrt(1 - z * z);
    for (int i = 0; i < kMeridians; ++i) {
      const double azimuth = 2 * std::numbers::pi * (i + 0.5) / kMeridians;
      const Vector3d h(r * std::cos(azimuth), r * std::sin(azimuth), z);
      const Esg7::Basis<double> basis = Esg7::basis<double>(h);
      const Esg7::Basis<double> across = basis - h * (h.transpose() * basis);
      square += weight * across.transpose() * across;
      product += weight * across.transpose() * rate_rad_s(h);
    }
  }
  return square.ldlt().solve(product);
}

}  // namespace trihedron::sim
