#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/core/drift.hpp"
#include "trihedron/core/harmonics.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::ground {

/// A linear drift family whose size is known at run time: ω_b(h) = B(h) κ, as the models of core/drift.hpp.
class DriftFamily {
 public:
  static constexpr int kMaxDegree = 6;
  static constexpr int kMaxSize = 2 * kMaxDegree * (kMaxDegree + 2);
  /// Columns by coefficient; no heap.
  using Basis = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxSize>;

  /// "esg7"; "esg20"; "vsh:1" … "vsh:6": eq. (1) and all members of −∇W + h × ∇D up to that degree that it does not
  /// contain, amplitudes of orthonormal real harmonics (mathematics, section 3). Nothing for another name.
  [[nodiscard]] static std::optional<DriftFamily> named(std::string_view model);

  /// Of a model of core/drift.hpp.
  template <class Model>
  [[nodiscard]] static DriftFamily of() {
    return *named(Model::kModelName);
  }

  [[nodiscard]] int size() const { return static_cast<int>(names_.size()); }
  /// Those of eq. (1) come first.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// Prior sigma of a coefficient by that of those of eq. (1): further members are taken to be smaller, of each degree
  /// from 2 on the more so the faster they change with h, so that each moves the momentum alike.
  [[nodiscard]] double prior_factor(int coefficient) const;

  /// B(h); h: unit, case axes. What points along h moves nothing.
  [[nodiscard]] Basis basis(const Eigen::Vector3d& h) const;

 private:
  DriftFamily() : table_(kMaxDegree) {}

  bool esg20_ = false;
  std::vector<std::string> names_;
  std::vector<DriftHarmonic> members_;  ///< of vsh
  HarmonicTable table_;
};

}  // namespace trihedron::ground
