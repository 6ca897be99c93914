#pragma once

#include <Eigen/Core>
#include <type_traits>
#include <vector>

#include "trihedron/core/drift.hpp"
#include "trihedron/core/harmonics.hpp"
#include "trihedron/records/drift_models.hpp"

namespace trihedron::ground {

/// A linear drift family whose size is known at run time: ω_b(h) = B(h) κ, as the models of core/drift.hpp.
class DriftFamily {
 public:
  static constexpr int kMaxDegree = kLargestDriftModel.degree;
  static constexpr int kMaxSize = 2 * kMaxDegree * (kMaxDegree + 2);
  /// Columns by coefficient; no heap.
  using Basis = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxSize>;

  /// Of vsh: amplitudes of orthonormal real harmonics (mathematics, section 3), 1 ≤ degree ≤ kMaxDegree.
  explicit DriftFamily(const DriftModelId& model);

  /// Of a model of core/drift.hpp.
  template <class Model>
  [[nodiscard]] static DriftFamily of() {
    return DriftFamily(std::is_same_v<Model, Esg20> ? kEsg20 : kEsg7);
  }

  [[nodiscard]] const DriftModelId& model() const { return model_; }
  [[nodiscard]] int size() const { return static_cast<int>(coefficients_.size()); }
  /// Those of eq. (1) come first.
  [[nodiscard]] const std::vector<DriftCoefficient>& coefficients() const { return coefficients_; }
  /// Prior sigma of a coefficient by that of those of eq. (1): further members are taken to be smaller, of each degree
  /// from 2 on the more so the faster they change with h, so that each moves the momentum alike.
  [[nodiscard]] double prior_factor(int coefficient) const;

  /// B(h); h: unit, case axes. What points along h moves nothing.
  [[nodiscard]] Basis basis(const Eigen::Vector3d& h) const;

 private:
  DriftModelId model_;
  std::vector<DriftCoefficient> coefficients_;
  HarmonicTable table_;
};

/// Whether a drift model is of the batch alone. It has a smaller one beside it on board.
[[nodiscard]] constexpr bool is_for_whole_pass(const DriftModelId& model) {
  return model.family == DriftModelId::Family::kVsh;
}

}  // namespace trihedron::ground
