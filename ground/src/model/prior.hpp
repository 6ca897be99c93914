#pragma once
/// The prior of the gyros.

#include "model/gyro.hpp"
#include "trihedron/core/layout.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Throws SetupError where the degree is not that of any model.
void refuse_unknown(const DriftModelId& drift_model);
/// Throws SetupError where the record does not have as many coefficients as its model.
void refuse_incomplete(const GyroCalibration& gyro);

/// The gyro of a record, with its momentum; what the layout has and the record lacks is zero. Drift that comes back
/// is told from when the record has it told from.
[[nodiscard]] Gyro gyro_of(const GyroCalibration& record, const Layout& layout);
/// The record of gyro `k` in the layout of the set-up, with the coefficients at the time when this fraction of their
/// change has taken place.
[[nodiscard]] GyroCalibration record_of(const Gyro& gyro, int k, const CalibrationSetup& setup, double part_of_change);
/// What the drift of a record depends on besides the direction, at a time.
[[nodiscard]] DriftTime drift_time(const GyroCalibration& record, Time t);
/// Of the drift of a record alone.
[[nodiscard]] Layout layout_of(const GyroCalibration& record);

/// From the earlier calibration that pass.toml names, or else from what it says of each gyro. Where that calibration
/// has a larger drift model, its coefficients are changed to what the smaller one needs along the same flight: by
/// themselves they are the drift without what is left out, which along that flight may be a large part of it. Throws
/// SetupError where these lack what the layout needs, or name coefficients that the drift model does not have.
[[nodiscard]] Prior prior_of(const PassSettings& settings, const Layout& layout);

}  // namespace trihedron::ground
