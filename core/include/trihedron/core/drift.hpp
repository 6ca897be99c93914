#pragma once
/// Drift of an electrostatic gyro: angular velocity of the rotor's momentum as a function of its direction in the case.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "trihedron/core/columns.hpp"
#include "trihedron/core/drift_model.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/core/harmonics.hpp"
#include "trihedron/core/layout.hpp"

namespace trihedron {

/// Eq. (1): seven members of the drift family, ω_b(h) = B(h) κ.
/// κ = (k0, μ12, μ23, μ31, ν12, ν23, ν31), rad/s. Only the part of ω across h moves the momentum.
struct Esg7 {
  static constexpr int kSize = 7;
  enum Index : int { kK0, kMu12, kMu23, kMu31, kNu12, kNu23, kNu31 };
  static constexpr std::array<const char*, kSize> kNames = {"k0", "mu12", "mu23", "mu31", "nu12", "nu23", "nu31"};

  template <class S>
  using Coefficients = Eigen::Matrix<S, kSize, 1>;
  template <class S>
  using Basis = Eigen::Matrix<S, 3, kSize>;

  /// B(h), the Jacobian of ω by κ. h: direction cosines in case axes, unit; a reading with noise is fine. Eq. (1).
  template <class S>
  [[nodiscard]] static Basis<S> basis(const Vector3<S>& h) {
    const Vector3<S> s = h.cwiseProduct(h);
    const Vector3<S> q = s.cwiseProduct(s);
    const S zero(0);
    Basis<S> b;
    // clang-format off
    b << h(0) * (q(0) - s(0) + q(1) + q(2)),  h(0) * s(1), zero, -h(0) * s(2),  zero, h(1) * h(2), zero,
         h(1) * (q(1) - s(1) + q(2) + q(0)), -h(1) * s(0),  h(1) * s(2), zero,  zero, zero, h(2) * h(0),
         h(2) * (q(2) - s(2) + q(0) + q(1)),  zero, -h(2) * s(1),  h(2) * s(0),  h(0) * h(1), zero, zero;
    // clang-format on
    return b;
  }

  /// ω_b(h) = B(h) κ, rad/s, case axes, without the zeros of B. Eq. (1).
  template <class S>
  [[nodiscard]] static Vector3<S> rate(const Vector3<S>& h, const Coefficients<S>& kappa) {
    const Vector3<S> s = h.cwiseProduct(h);
    const S sum4 = s(0) * s(0) + (s(1) * s(1) + s(2) * s(2));
    return {
        h(0) * (kappa(kK0) * (sum4 - s(0)) + kappa(kMu12) * s(1) - kappa(kMu31) * s(2)) + kappa(kNu23) * h(1) * h(2),
        h(1) * (kappa(kK0) * (sum4 - s(1)) + kappa(kMu23) * s(2) - kappa(kMu12) * s(0)) + kappa(kNu31) * h(2) * h(0),
        h(2) * (kappa(kK0) * (sum4 - s(2)) + kappa(kMu31) * s(0) - kappa(kMu23) * s(1)) + kappa(kNu12) * h(0) * h(1)};
  }

  /// ∂ω_b/∂h, rad/s, h taken as three free numbers. Eq. (1) differentiated.
  template <class S>
  [[nodiscard]] static Matrix3<S> rate_by_h(const Vector3<S>& h, const Coefficients<S>& kappa) {
    const Vector3<S> s = h.cwiseProduct(h);
    const Vector3<S> cube = s.cwiseProduct(h);
    const S sum4 = s.squaredNorm();
    const S k0 = kappa(kK0);
    const S mu12 = kappa(kMu12);
    const S mu23 = kappa(kMu23);
    const S mu31 = kappa(kMu31);
    const S nu12 = kappa(kNu12);
    const S nu23 = kappa(kNu23);
    const S nu31 = kappa(kNu31);
    const S two(2);
    Matrix3<S> d;
    // clang-format off
    d << mu12 * s(1) - mu31 * s(2), two * mu12 * h(0) * h(1) + nu23 * h(2), -two * mu31 * h(0) * h(2) + nu23 * h(1),
         -two * mu12 * h(0) * h(1) + nu31 * h(2), mu23 * s(2) - mu12 * s(0), two * mu23 * h(1) * h(2) + nu31 * h(0),
         two * mu31 * h(0) * h(2) + nu12 * h(1), -two * mu23 * h(1) * h(2) + nu12 * h(0), mu31 * s(0) - mu23 * s(1);
    // clang-format on
    // k0 row i: h_i (Σh⁴ − h_i²), differentiated by h_j.
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        d(i, j) += k0 * h(i) * S(4) * cube(j);
      }
      d(i, i) += k0 * (sum4 - S(3) * s(i));
    }
    return d;
  }
};

/// The member W(4, 4) of a model stands for what k0 leaves of W(4, 0) and W(4, 4), orthogonal to it over the sphere: Σ
/// h⁴ is √7 Y(4, 0) + √5 Y(4, 4), but for a factor and a constant.
struct BesideK0 {
  static constexpr int kDegree = 4;
  static constexpr double kOf40 = -0.6454972243679028;  ///< −√(5/12)
  static constexpr double kOf44 = 0.7637626158259733;   ///< √(7/12)

  [[nodiscard]] static constexpr bool is(const DriftCoefficient& member) {
    return member.member == DriftCoefficient::Member::kW && member.degree == kDegree && member.order == kDegree;
  }
};

/// What the drift of one gyro depends on besides the direction, at one time.
struct DriftTime {
  double part_of_change = 0;  ///< the fraction of the change of the coefficients that has taken place
  double orbital_sine = 0;    ///< sin nt
  double orbital_cosine = 0;  ///< cos nt
  double polhode_sine = 0;    ///< sin θ
  double polhode_cosine = 0;  ///< cos θ
};
using DriftTimes = PerGyro<DriftTime>;

/// Drift of one gyro as a table of columns: ω_b = B(h) κ, κ the coefficients of the members of the model; then, where
/// the layout has them, the drift that wanders, about the case axes, the change of the coefficients of eq. (1), the
/// drift at orbital period, about the case axes, and the coefficients of eq. (1) that come and go with the polhode.
class DriftModel {
 public:
  static constexpr int kMaxMembers = vsh(DriftModelId::kMaxDegree).size();

  DriftModel() : DriftModel(kEsg7, {}) {}
  DriftModel(DriftModelId id, const FurtherStates& further);

  /// The coefficients of the model; with all that follows them.
  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] int change_column() const { return size_ + (wandering_ ? 3 : 0); }
  [[nodiscard]] int orbital_column() const { return change_column() + (change_ ? Esg7::kSize : 0); }
  [[nodiscard]] int polhode_column() const { return orbital_column() + (orbital_ ? Layout::kOrbitalDrift : 0); }
  [[nodiscard]] int columns() const { return polhode_column() + (polhode_ ? Layout::kPolhode : 0); }
  /// Which member of the family column i is; i < size().
  [[nodiscard]] const DriftCoefficient& member(int i) const { return members_[static_cast<std::size_t>(i)]; }

  /// The columns at a direction h in case axes, unit. Parts along h move nothing and are left in. B: of columns(), and
  /// is padded.
  void basis(const Eigen::Vector3d& h, const DriftTime& time, ColumnsView B) const;

  /// ω_b(h), rad/s, case axes, by a gyro's coefficients of all columns.
  [[nodiscard]] Eigen::Vector3d rate(const Eigen::Vector3d& h, const DriftTime& time, const double* coefficients) const;

 private:
  void put_beside_eq1(const Eigen::Vector3d& h, ColumnsView B) const;
  [[nodiscard]] Eigen::Vector3d rate_beside_eq1(const Eigen::Vector3d& h, const double* coefficients) const;

  std::array<DriftCoefficient, kMaxMembers> members_{};
  HarmonicTableOf<DriftModelId::kMaxDegree> harmonics_;
  DriftModelId id_;
  std::int16_t size_;
  bool wandering_ = false;
  bool change_ = false;
  bool orbital_ = false;
  bool polhode_ = false;
};

}  // namespace trihedron
