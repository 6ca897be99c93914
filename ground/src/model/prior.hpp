#pragma once
/// What is known of the gyros before a pass.

#include "model/gyro.hpp"
#include "trihedron/core/layout.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Throws SetupError where the degree is not that of any model.
void refuse_unknown(const DriftModelId& drift_model);
/// Throws SetupError where the record does not have as many coefficients as its model.
void refuse_incomplete(const GyroCalibration& gyro);

/// As the record has it, with its momentum; coefficients of the layout that it does not have are zero.
[[nodiscard]] Gyro gyro_of(const GyroCalibration& record, const Layout& layout);
/// The coefficients stand for when so much of their change has been.
[[nodiscard]] GyroCalibration record_of(const Gyro& gyro, const Layout& layout, double part_of_change);

/// By what pass.toml says of each gyro, or else by the earlier calibration that it names. Throws SetupError where that
/// says less than the layout needs, or speaks of coefficients that its drift model does not have.
[[nodiscard]] Prior prior_of(const PassSettings& settings, const Layout& layout);

}  // namespace trihedron::ground
