#pragma once
/// The flight code's model of a gyro as one of calibration.json.

#include "trihedron/core/precession.hpp"
#include "trihedron/records/calibration.hpp"

namespace trihedron::ground {

/// The coefficients of Base, which the model has first.
template <class Base, class Model>
[[nodiscard]] GyroCalibration to_record(const GyroModel<Model>& model) {
  GyroCalibration gyro;
  gyro.drift_model = Base::kModelName;
  for (std::size_t i = 0; i < Base::kSize; ++i) {
    gyro.drift_rad_s.emplace_back(Base::kNames[i], model.drift_rad_s(static_cast<Eigen::Index>(i)));
  }
  gyro.alignment_rotation_vector_rad = Rot<C, B<1>>::assume(model.C_c_b).log().raw();
  gyro.readout_bias = model.readout_bias;
  gyro.momentum_in = model.h_in;
  return gyro;
}

}  // namespace trihedron::ground
