#include "consistency/bound.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "trihedron/core/drift.hpp"
#include "trihedron/core/setup.hpp"

namespace trihedron::consistency {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Unknowns of one gyro: the initial direction by two components across it, κ, δ.
constexpr int kDrift = 2;
constexpr int kAlignment = kDrift + Esg7::kSize;
constexpr int kPerGyro = kAlignment + 3;
using Unknowns = Eigen::Matrix<double, kPerGyro, 1>;
using ByUnknowns = Eigen::Matrix<double, 3, kPerGyro>;

/// Rows: two unit vectors across h and across each other.
Eigen::Matrix<double, 2, 3> across(const Vector3d& h) {
  Eigen::Matrix<double, 2, 3> rows;
  rows.row(0) = h.unitOrthogonal().transpose();
  rows.row(1) = h.cross(rows.row(0).transpose()).transpose();
  return rows;
}

/// How one true momentum moves with the unknowns: φ = by_unknowns · x.
class Sensitivities {
 public:
  Sensitivities(const Truth::Gyro& truth, const Vector3d& h_in)
      : C_c_b_(Rot<C, C>::exp(Vec<C>::assume(truth.alignment_rotation_vector_rad)).raw()) {
    for (int i = 0; i < Esg7::kSize; ++i) {
      kappa_rad_s_(i) = truth.drift_rad_s[static_cast<std::size_t>(i)].second;
    }
    by_unknowns_.leftCols<2>() = across(h_in).transpose();
  }

  [[nodiscard]] const ByUnknowns& by_unknowns() const { return by_unknowns_; }

  /// From one fix to the next, by Runge and Kutta's rule; attitude and momentum at begin, middle, end.
  void step(const std::array<Matrix3d, 3>& C_in_c, const std::array<Vector3d, 3>& h_in, double step_s) {
    const ByUnknowns& x = by_unknowns_;
    const ByUnknowns k1 = step_s * rate(C_in_c[0], h_in[0], x);
    const ByUnknowns k2 = step_s * rate(C_in_c[1], h_in[1], x + k1 / 2);
    const ByUnknowns k3 = step_s * rate(C_in_c[1], h_in[1], x + k2 / 2);
    const ByUnknowns k4 = step_s * rate(C_in_c[2], h_in[2], x + k3);
    by_unknowns_ += (k1 + 2 * (k2 + k3) + k4) / 6;
  }

 private:
  /// dφ/dt = ω × φ + C_in_b B Δκ + (C_in_c δ) × ω
  [[nodiscard]] ByUnknowns rate(const Matrix3d& C_in_c, const Vector3d& h_in, const ByUnknowns& phi) const {
    const Matrix3d C_in_b = C_in_c * C_c_b_;
    const Esg7::Basis<double> by_kappa = C_in_b * Esg7::basis<double>(C_in_b.transpose() * h_in);
    const Matrix3d cross_omega = skew<double>(by_kappa * kappa_rad_s_);
    ByUnknowns rate = cross_omega * phi;
    rate.middleCols<Esg7::kSize>(kDrift) += by_kappa;
    rate.rightCols<3>() -= cross_omega * C_in_c;
    return rate;
  }

  Matrix3d C_c_b_;
  Esg7::Coefficients<double> kappa_rad_s_;
  ByUnknowns by_unknowns_ = ByUnknowns::Zero();
};

/// 1-sigma of a cubic at the middle of 2 m + 1 evenly spaced readings, over that of one (Savitzky and Golay, 1964).
double noise_of_cubic(double m) {
  return std::sqrt(3 * (3 * m * m + 3 * m - 1) / ((2 * m - 1) * (2 * m + 1) * (2 * m + 3)));
}

}  // namespace

ParameterCovariance parameter_bound(const PassSettings& settings, const Truth& truth) {
  const auto momentum = [&](std::size_t i, std::size_t k) {
    return Vector3d(Eigen::Map<const Vector3d>(&truth.h_in[(i * kGyros + k) * 3]));
  };
  constexpr int kUnknowns = kGyros * kPerGyro;
  using Information = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  // In units of the prior sigmas. Nothing is known of the directions before; their unit is that of the alignments.
  Eigen::Matrix<double, kUnknowns, 1> unit;
  Information information = Information::Identity();
  std::vector<Sensitivities> gyros;
  for (std::size_t k = 0; k < kGyros; ++k) {
    const GyroPrior& prior = settings.gyros[k];
    const auto first = static_cast<Eigen::Index>(k) * kPerGyro;
    auto own = unit.segment<kPerGyro>(first);
    own.segment<Esg7::kSize>(kDrift).setConstant(prior.drift_common_sigma_rad_s);
    own.tail<3>() = prior.alignment_sigma_rad;
    own.head<2>().setConstant(prior.alignment_sigma_rad.mean());
    information.block<2, 2>(first, first).setZero();
    gyros.emplace_back(truth.gyros[k], momentum(0, k));
  }
  CalibrationSetup setup;
  setup.gyro_period = settings.gyro_period;
  const Duration reach = setup.reach();
  const double fitted = noise_of_cubic(static_cast<double>(reach / settings.gyro_period));

  for (std::size_t i = 0; i < truth.t.size(); ++i) {
    const bool readings_on_both_sides = truth.t[i] - reach >= truth.t.front() && truth.t[i] + reach <= truth.t.back();
    const Matrix3d C_in_c = truth.q_in_c[i].toRotationMatrix();
    Eigen::Matrix<double, 2 * kGyros, kUnknowns> H = Eigen::Matrix<double, 2 * kGyros, kUnknowns>::Zero();
    Eigen::Matrix<double, 2 * kGyros, 3> by_fix;
    Eigen::Matrix<double, 2 * kGyros, 1> readout_rad;
    for (std::size_t k = 0; k < kGyros; ++k) {
      const auto row = static_cast<Eigen::Index>(k) * 2;
      const auto first = static_cast<Eigen::Index>(k) * kPerGyro;
      const Eigen::Matrix<double, 2, 3> rows = across(momentum(i, k));
      H.block<2, kPerGyro>(row, first) = rows * gyros[k].by_unknowns();
      H.block<2, 3>(row, first + kAlignment) -= rows * C_in_c;
      by_fix.middleRows<2>(row) = rows * C_in_c;
      readout_rad.segment<2>(row).setConstant(settings.gyros[k].readout_noise_rad *
                                              (readings_on_both_sides ? fitted : 1));
    }
    const Eigen::Matrix<double, 2 * kGyros, 3> fix_noise = by_fix * settings.star_tracker_noise_rad.asDiagonal();
    Eigen::Matrix4d R = fix_noise * fix_noise.transpose();
    R.diagonal() += readout_rad.cwiseAbs2();
    const Eigen::Matrix<double, 2 * kGyros, kUnknowns> white = R.llt().matrixL().solve(H * unit.asDiagonal());
    information += white.transpose() * white;

    if (i + 1 < truth.t.size()) {
      const Eigen::Quaterniond& next = truth.q_in_c[i + 1];
      const std::array<Matrix3d, 3> attitudes = {C_in_c, truth.q_in_c[i].slerp(0.5, next).toRotationMatrix(),
                                                 next.toRotationMatrix()};
      for (std::size_t k = 0; k < kGyros; ++k) {
        const Vector3d begin = momentum(i, k);
        const Vector3d end = momentum(i + 1, k);
        gyros[k].step(attitudes, {begin, (begin + end).normalized(), end}, to_seconds(truth.t[i + 1] - truth.t[i]));
      }
    }
  }

  const Information covariance =
      unit.asDiagonal() * Information(information.llt().solve(Information::Identity())) * unit.asDiagonal();
  ParameterCovariance bound;
  for (int k = 0; k < kGyros; ++k) {
    for (int j = 0; j < kGyros; ++j) {
      bound.block<Parameters::kPerGyro, Parameters::kPerGyro>(Parameters::drift(k), Parameters::drift(j)) =
          covariance.block<Parameters::kPerGyro, Parameters::kPerGyro>(k * kPerGyro + kDrift, j * kPerGyro + kDrift);
    }
  }
  return bound;
}

}  // namespace trihedron::consistency
