#pragma once
/// What an estimator on board takes of a drift field that it has no room for: a smaller model, and the rest as drift
/// that wanders.

#include <map>
#include <vector>

#include "model/left_out.hpp"
#include "trihedron/core/drift_model.hpp"
#include "trihedron/records/calibration.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Whether the prior of a gyro names a coefficient that eq. (1) does not have.
[[nodiscard]] bool knows_of_drift_outside(const PassSettings& settings);

/// Mean square of each member outside eq. (1), what is expected of it and its variance together, (rad/s)², gyro by
/// gyro.
using MeanSquares = std::vector<std::map<DriftCoefficient, double>>;

/// Those that a calibration knows.
[[nodiscard]] MeanSquares mean_squares_of(const Calibration& calibration);

/// A model that an estimator on board has room for.
struct DriftOnBoard {
  DriftModelId drift_model;
  /// Of all members that it has not, root mean square over the sphere about each of the two axes across the momentum,
  /// rad/s, of the gyro that has the most of them; 0 where it is negligible.
  double left_out_rad_s = 0;
};

/// The smallest one that leaves out a small part; eq. (1) where there is next to nothing outside.
[[nodiscard]] DriftOnBoard drift_on_board(const MeanSquares& members);
/// What this model leaves out.
[[nodiscard]] DriftOnBoard drift_on_board(const MeanSquares& members, const DriftModelId& model);

/// Adds to the members that are kept what makes up for those left out, so that these are mean squares of coefficients
/// that do. `all`: the calibration that is reduced.
void add_made_up(const LeftOut& left_out, const Calibration& all, MeanSquares& members);

/// The model and, beside the noise that the options have, what it leaves out.
void use(const DriftOnBoard& drift, CalibrationOptions& options);

/// What an estimator on board takes of a calibration with a drift field: the model and the noise that it says, or, of a
/// calibration that does not, drift that wanders for what the model leaves out.
void use_on_board(const Calibration& field, CalibrationOptions& options);

/// The prior sigmas of the members of the model; those that the settings have stay.
void use(const MeanSquares& members, const DriftModelId& model, PassSettings& settings);

}  // namespace trihedron::ground
