#pragma once
/// Drift of one gyro by coefficients that stay as they are, for many directions.

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "trihedron/core/drift.hpp"

namespace trihedron::ground {

/// DriftModel::rate() of one set of coefficients, to rounding. The members of each order are summed before they are
/// multiplied by what they have in common, which is a quarter of the work for all members up to degree 8.
class RotorDrift {
 public:
  RotorDrift() = default;
  /// `coefficients`: of all columns of the model. Those of the drift that wanders are not taken.
  RotorDrift(const DriftModel& model, const double* coefficients);

  /// ω_b(h), rad/s, case axes, without drift that wanders; h unit.
  [[nodiscard]] Eigen::Vector3d rate(const Eigen::Vector3d& h, const DriftTime& time) const;

 private:
  static constexpr int kOrders = DriftModelId::kMaxDegree + 1;
  /// W and D, each with Re and Im of (x + iy)^m.
  using OfOrder [[gnu::vector_size(4 * sizeof(double))]] = double;

  /// A harmonic more.
  void add(DriftCoefficient::Member potential, int degree, int order, double amplitude);

  Esg7::Coefficients<double> eq1_ = Esg7::Coefficients<double>::Zero();
  Esg7::Coefficients<double> change_ = Esg7::Coefficients<double>::Zero();
  Eigen::Vector3d orbital_sine_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d orbital_cosine_ = Eigen::Vector3d::Zero();
  Esg7::Coefficients<double> polhode_sine_ = Esg7::Coefficients<double>::Zero();
  Esg7::Coefficients<double> polhode_cosine_ = Esg7::Coefficients<double>::Zero();
  double cube_d_ = 0;
  int degree_ = 0;
  /// By order and degree, with the norm of the harmonic.
  std::array<std::array<OfOrder, kOrders>, kOrders> outside_{};
};

}  // namespace trihedron::ground
