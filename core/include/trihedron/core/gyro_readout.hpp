#pragma once
/// How one gyro reads the direction of its momentum.

#include <Eigen/Core>

#include "trihedron/core/frames.hpp"
#include "trihedron/core/layout.hpp"

namespace trihedron {

/// Alignment of a gyro and errors of its direction cosines. Plain numbers with frames in the names. The errors that can
/// be estimated are linear, and all that depends on which of them there are stands here.
struct GyroReadout {
  static constexpr int kMaxErrors = kLargestLayout.readout_size();
  /// One number for each error that the layout has, in its order.
  using Errors = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxErrors, 1>;
  using ErrorColumns = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxErrors>;

  Eigen::Matrix3d C_c_b = Eigen::Matrix3d::Identity();     ///< alignment, exp([Λ×])
  Eigen::Vector3d readout_bias = Eigen::Vector3d::Zero();  ///< of the direction cosines: h_b is read as h_b + bias

  /// A reading, unit, without what is known of its errors; case axes.
  [[nodiscard]] Eigen::Vector3d corrected(const Eigen::Vector3d& h_b) const { return without_bias(h_b, readout_bias); }
  /// The same, seen in c.
  [[nodiscard]] Eigen::Vector3d in_c(const Eigen::Vector3d& h_b) const { return C_c_b * corrected(h_b); }
  /// What it reads of a direction in c, to the first order in the errors.
  [[nodiscard]] Eigen::Vector3d reading_of(const Eigen::Vector3d& h_c) const {
    return C_c_b.transpose() * h_c + readout_bias;
  }

  /// Estimates of the errors.
  [[nodiscard]] Errors errors(const Layout& layout) const {
    Errors values(layout.readout_size());
    if (layout.further.readout_bias) {
      values.head<3>() = readout_bias;
    }
    return values;
  }
  void add_errors(const Layout& layout, const Errors& x) {
    if (layout.further.readout_bias) {
      readout_bias += x.head<3>();
    }
  }
  /// Derivative of a reading by them, 3 × layout.readout_size(), case axes.
  [[nodiscard]] static ErrorColumns by_errors(const Layout& layout, const Eigen::Vector3d& /*h_b*/) {
    ErrorColumns columns(3, layout.readout_size());
    if (layout.further.readout_bias) {
      columns.leftCols<3>().setIdentity();
    }
    return columns;
  }
};

}  // namespace trihedron
