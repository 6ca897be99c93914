#pragma once
/// The flight code's model of a gyro as one of calibration.json.

#include <type_traits>

#include "trihedron/core/drift.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/records/calibration.hpp"

namespace trihedron::ground {

/// The coefficients of Base, which the model has first.
template <class Base, class Model>
[[nodiscard]] GyroCalibration to_record(const GyroModel<Model>& model) {
  GyroCalibration gyro;
  gyro.drift_model = std::is_same_v<Base, Esg20> ? kEsg20 : kEsg7;
  gyro.drift_rad_s.assign(model.drift_rad_s.begin(), model.drift_rad_s.begin() + Base::kSize);
  gyro.alignment_rotation_vector_rad = Rot<C, B<1>>::assume(model.C_c_b).log().raw();
  gyro.readout_bias = model.readout_bias;
  gyro.momentum_in = model.h_in;
  return gyro;
}

}  // namespace trihedron::ground
