#pragma once
/// What is known of the gyros before a pass.

#include <Eigen/Core>
#include <vector>

#include "model/drift_family.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Throws SetupError where the degree is not that of any.
[[nodiscard]] DriftFamily family_of(const DriftModelId& drift_model);
/// Throws SetupError where the record does not have as many coefficients as its model.
[[nodiscard]] DriftFamily family_of(const GyroCalibration& gyro);

/// What is known of a gyro.
struct GyroParameters {
  Eigen::VectorXd drift_rad_s;                          ///< κ
  Eigen::Matrix3d C_c_b = Eigen::Matrix3d::Identity();  ///< alignment
  Eigen::Vector3d readout_bias = Eigen::Vector3d::Zero();
  /// Of the coefficients of eq. (1), evenly over the pass; κ is that of its end.
  Eigen::Matrix<double, Esg7::kSize, 1> change_rad_s = Eigen::Matrix<double, Esg7::kSize, 1>::Zero();
};

/// What a gyro reads, seen in c.
[[nodiscard]] Eigen::Vector3d seen_in_c(const GyroParameters& gyro, const Eigen::Vector3d& h_b);

/// As the record has them; coefficients that it does not have are zero.
[[nodiscard]] GyroParameters parameters_of(const GyroCalibration& gyro, const DriftFamily& family);

/// Without a momentum.
[[nodiscard]] GyroCalibration record_of(const GyroParameters& parameters, const DriftFamily& family);

struct ParameterPrior {
  std::vector<GyroParameters> gyros;  ///< means
  Eigen::MatrixXd covariance;         ///< of κ and δ, gyro by gyro
};

/// Of the first so many gyros, by what pass.toml says of each, or else by the earlier calibration that it names.
/// Throws SetupError where that says less than the family needs, or speaks of coefficients that the family does not
/// have.
[[nodiscard]] ParameterPrior prior_of(const PassSettings& settings, int gyros, const DriftFamily& family);

}  // namespace trihedron::ground
