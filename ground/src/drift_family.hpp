#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "trihedron/core/drift.hpp"

namespace trihedron::ground {

/// A linear drift family whose size is known at run time: ω_b(h) = B(h) κ, as the models of core/drift.hpp.
class DriftFamily {
 public:
  static constexpr int kMaxSize = 128;
  /// Columns by coefficient; no heap.
  using Basis = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxSize>;

  template <class Model>
  [[nodiscard]] static DriftFamily of() {
    DriftFamily family;
    family.name_ = Model::kModelName;
    family.names_.assign(Model::kNames.begin(), Model::kNames.end());
    family.basis_ = [](const Eigen::Vector3d& h) { return Basis(Model::template basis<double>(h)); };
    return family;
  }

  [[nodiscard]] const std::string& name() const { return name_; }
  /// Of the coefficients, in their order.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  [[nodiscard]] int size() const { return static_cast<int>(names_.size()); }
  /// B(h); h: unit, case axes.
  [[nodiscard]] Basis basis(const Eigen::Vector3d& h) const { return basis_(h); }

 private:
  DriftFamily() = default;

  std::string name_;
  std::vector<std::string> names_;
  Basis (*basis_)(const Eigen::Vector3d&) = nullptr;
};

}  // namespace trihedron::ground
