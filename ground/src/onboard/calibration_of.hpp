#pragma once
/// The calibration of an on-board object as the record that the ground keeps.

#include <Eigen/Core>

#include "model/gyro.hpp"
#include "model/prior.hpp"
#include "model/setup.hpp"
#include "trihedron/core/on_board.hpp"
#include "trihedron/records/calibration.hpp"

namespace trihedron::ground {

using Roots = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Copies gyros into storage of another capacity.
template <class To, class From>
[[nodiscard]] To with_room(const From& from, const Layout& layout) {
  To to;
  for (int k = 0; k < layout.gyros; ++k) {
    GyroReadout& readout = to[k];
    const GyroReadout& its = from[k];
    readout = its;
    to[k].h_in = from[k].h_in;
    to[k].drift_rad_s = from[k].drift_rad_s;
  }
  return to;
}

/// Root of the covariance, root rootᵀ, of κ and δ of a started estimator, with the coefficients at the time when this
/// fraction of their change has taken place.
template <class Estimator>
[[nodiscard]] Roots parameter_root(const Estimator& estimator, double part_of_change) {
  const Layout& layout = estimator.layout();
  Roots errors(estimator.error_layout().shared(), estimator.states());
  estimator.error_root(rows_of(errors));
  Roots root = errors.middleRows(layout.drift(0), layout.parameters());
  if (layout.further.coefficient_change) {
    for (int k = 0; k < layout.gyros; ++k) {
      root.middleRows(layout.drift(k) - layout.drift(0), Layout::kEq1) +=
          part_of_change * errors.middleRows(layout.change(k), Layout::kEq1);
    }
  }
  return root;
}

/// Covariance of the errors of a started estimator at its last fix, the states before those that the gyros share, with
/// the coefficients at the time when this fraction of their change has taken place.
template <class Estimator>
[[nodiscard]] Eigen::MatrixXd error_covariance(const Estimator& estimator, double part_of_change) {
  const Layout layout = estimator.error_layout();
  Roots errors(layout.shared(), estimator.states());
  estimator.error_root(rows_of(errors));
  for (int k = 0; k < layout.gyros && layout.further.coefficient_change; ++k) {
    errors.middleRows(layout.drift(k), Layout::kEq1) +=
        part_of_change * errors.middleRows(layout.change(k), Layout::kEq1);
  }
  return errors * errors.transpose();
}

/// The gyros as records, with the coefficients of that time.
template <class Gyros>
[[nodiscard]] std::vector<GyroCalibration> records_of(const Gyros& gyros, const CalibrationSetup& setup,
                                                      double part_of_change) {
  const auto roomy = with_room<ground::Gyros>(gyros, setup.layout);
  std::vector<GyroCalibration> records;
  for (int k = 0; k < setup.layout.gyros; ++k) {
    records.push_back(record_of(roomy[k], k, setup, part_of_change));
  }
  return records;
}

/// Values and covariance as of the latest sample, of a started on-board object; without verdict and statistics, and
/// without what is told by the options that it was set up by.
template <class Estimator>
[[nodiscard]] Calibration calibration_of(const OnBoard<Estimator>& on_board, Time epoch) {
  const Estimator& estimator = on_board.estimator();
  const Layout& layout = estimator.layout();
  const double part_of_change = estimator.setup().part_of_change(on_board.t());
  Calibration result;
  result.epoch = epoch;
  result.t = on_board.t();
  result.gyros = records_of(estimator.gyros(), estimator.setup(), part_of_change);
  result.states = drift_and_alignment(layout.drift_model, static_cast<std::size_t>(layout.gyros));
  const Roots root = parameter_root(estimator, part_of_change);
  result.covariance = root * root.transpose();
  result.noise = CalibrationNoise{estimator.setup().direction_random_walk_rad_sqrt_s, {}};
  if constexpr (requires { estimator.shared(); }) {
    const auto gyros = with_room<Gyros>(estimator.gyros(), layout);
    Roots all(layout.size(), layout.size());
    estimator.error_root(rows_of(all));
    for (const ParameterId& parameter : further_parameters(layout)) {
      result.further.push_back({parameter, value_of(layout, gyros, estimator.shared(), parameter),
                                all.row(state_of(layout, parameter)).norm()});
    }
  }
  return result;
}

}  // namespace trihedron::ground
