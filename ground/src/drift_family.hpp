#pragma once

#include <Eigen/Core>

#include "trihedron/core/drift.hpp"

namespace trihedron::ground {

/// A linear drift family whose size is known at run time: ω_b(h) = B(h) κ, as the models of core/drift.hpp.
class DriftFamily {
 public:
  static constexpr int kMaxSize = Esg20::kSize;
  /// Columns by coefficient; no heap.
  using Basis = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxSize>;

  template <class Model>
  [[nodiscard]] static DriftFamily of() {
    DriftFamily family;
    family.basis_ = [](const Eigen::Vector3d& h) { return Basis(Model::template basis<double>(h)); };
    return family;
  }

  /// B(h); h: unit, case axes.
  [[nodiscard]] Basis basis(const Eigen::Vector3d& h) const { return basis_(h); }

 private:
  DriftFamily() = default;

  Basis (*basis_)(const Eigen::Vector3d&) = nullptr;
};

}  // namespace trihedron::ground
