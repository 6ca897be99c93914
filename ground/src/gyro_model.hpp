#pragma once
/// A gyro of calibration.json as the flight code's model, and back.

#include <algorithm>

#include "trihedron/core/precession.hpp"
#include "trihedron/records/calibration.hpp"

namespace trihedron::ground {

/// Whether the record holds exactly the coefficients of Model, in its order.
template <class Model>
[[nodiscard]] bool is_of_model(const GyroCalibration& gyro) {
  return gyro.drift_model == Model::kModelName &&
         std::equal(gyro.drift_rad_s.begin(), gyro.drift_rad_s.end(), Model::kNames.begin(), Model::kNames.end(),
                    [](const auto& coefficient, const char* name) { return coefficient.first == name; });
}

/// Needs is_of_model().
template <class Model>
[[nodiscard]] GyroModel<Model> to_model(const GyroCalibration& gyro) {
  GyroModel<Model> model;
  for (std::size_t i = 0; i < Model::kSize; ++i) {
    model.drift_rad_s(static_cast<Eigen::Index>(i)) = gyro.drift_rad_s[i].second;
  }
  model.C_c_b = Rot<C, B<1>>::exp(Vec<C>::assume(gyro.alignment_rotation_vector_rad)).raw();
  model.readout_bias = gyro.readout_bias;
  model.h_in = gyro.momentum_in;
  return model;
}

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
