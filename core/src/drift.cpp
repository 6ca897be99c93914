#include "trihedron/core/drift.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace trihedron {
namespace {

using Member = DriftCoefficient::Member;

/// W and D of Σ a_i h_i²/2 and of h1 h2 h3, and of degree 4 the W of Σ h⁴/4, which is made of (4, 0) and (4, 4).
constexpr bool is_in_eq1(Member potential, int degree, int order) {
  return (degree == 2 && (order == 0 || order == 2)) || (degree == 3 && order == -2) ||
         (degree == 4 && order == 0 && potential == Member::kW);
}

constexpr int max_degree_of(DriftModelId id) {
  constexpr int kEsg20Degree = 2;
  return id.family == DriftModelId::Family::kVsh     ? id.degree
         : id.family == DriftModelId::Family::kEsg20 ? kEsg20Degree
                                                     : 0;
}

/// Gradients of the potentials of members, kept for one degree at a time: W and D of a harmonic are made of the same.
/// Members that come degree by degree make each once.
template <class Harmonics>
class Gradients {
 public:
  explicit Gradients(const Harmonics& harmonics) : harmonics_(harmonics) {}

  [[nodiscard]] Eigen::Vector3d of(const DriftCoefficient& member) {
    if (member.degree != degree_) {
      degree_ = member.degree;
      for (int order = 0; order <= degree_; ++order) {
        const auto gradients = harmonics_.polynomial_gradients(degree_, order);
        at(-order) = gradients[1];
        at(order) = gradients[0];  // last: order 0 has a cosine alone
      }
    }
    return BesideK0::is(member) ? Eigen::Vector3d(BesideK0::kOf44 * at(4) + BesideK0::kOf40 * at(0)) : at(member.order);
  }

 private:
  [[nodiscard]] Eigen::Vector3d& at(int order) {
    const int place = DriftModelId::kMaxDegree + order;
    return of_degree_[static_cast<std::size_t>(place)];
  }

  const Harmonics& harmonics_;
  std::int8_t degree_ = 0;  ///< none yet
  std::array<Eigen::Vector3d, 2 * DriftModelId::kMaxDegree + 1> of_degree_;
};

}  // namespace

DriftModel::DriftModel(DriftModelId id, const FurtherStates& further)
    : harmonics_(max_degree_of(id)),
      wandering_(further.wandering_drift),
      change_(further.coefficient_change),
      orbital_(further.orbital_drift),
      polhode_(further.polhode) {
  size_ = 0;
  for (int number = 0; number < Esg7::kSize; ++number) {
    members_[static_cast<std::size_t>(size_++)] = DriftCoefficient::of_eq1(number);
  }
  const int max_degree = max_degree_of(id);
  const auto add_degrees = [&](int from, int to, Member potential) {
    for (int degree = from; degree <= to; ++degree) {
      for (int order = -degree; order <= degree; ++order) {
        if (!is_in_eq1(potential, degree, order)) {
          add(potential, degree, order);
        }
      }
    }
  };
  if (id.family == DriftModelId::Family::kEsg20) {  // W before D
    add_degrees(1, max_degree, Member::kW);
    add_degrees(1, max_degree, Member::kD);
    add(Member::kCubeD, 0, 0);
  } else {  // degree by degree
    for (int degree = 1; degree <= max_degree; ++degree) {
      add_degrees(degree, degree, Member::kW);
      add_degrees(degree, degree, Member::kD);
    }
  }
  TRIHEDRON_ASSERT(size_ == id.size());
}

void DriftModel::add(Member member, int degree, int order) {
  members_[static_cast<std::size_t>(size_++)] = {member, static_cast<std::int8_t>(degree),
                                                 static_cast<std::int8_t>(order)};
}

void DriftModel::basis(const Eigen::Vector3d& h, const DriftTime& time, ColumnsView B) const {
  const Eigen::Matrix<double, 3, Esg7::kSize> eq1 = Esg7::basis<double>(h);
  for (int i = 0; i < 3; ++i) {
    double* row = B.row(i);
    for (int j = 0; j < Esg7::kSize; ++j) {
      row[j] = eq1(i, j);
    }
  }
  if (size_ > Esg7::kSize) {
    const auto harmonics = harmonics_.at<double>(h);
    Gradients gradients(harmonics);
    for (int i = Esg7::kSize; i < size_; ++i) {
      const DriftCoefficient& its = member(i);
      switch (its.member) {
        case Member::kW:
          B.set_column(i, -gradients.of(its));
          break;
        case Member::kD:
          B.set_column(i, h.cross(gradients.of(its)));
          break;
        default:
          B.set_column(i, h.cross(h.cwiseProduct(h).cwiseProduct(h)));
          break;
      }
    }
  }
  int column = size_;
  if (wandering_) {
    for (int i = 0; i < 3; ++i) {
      B.set_column(column++, Eigen::Vector3d::Unit(i));
    }
  }
  if (change_) {
    for (int i = 0; i < Esg7::kSize; ++i) {
      B.set_column(column++, time.part_of_change * eq1.col(i));
    }
  }
  if (orbital_) {
    for (int i = 0; i < 3; ++i) {
      B.set_column(column + i, time.orbital_sine * Eigen::Vector3d::Unit(i));
      B.set_column(column + 3 + i, time.orbital_cosine * Eigen::Vector3d::Unit(i));
    }
    column += Layout::kOrbitalDrift;
  }
  if (polhode_) {
    for (int i = 0; i < Esg7::kSize; ++i) {
      B.set_column(column + i, time.polhode_sine * eq1.col(i));
      B.set_column(column + Esg7::kSize + i, time.polhode_cosine * eq1.col(i));
    }
  }
  B.pad();
}

Eigen::Vector3d DriftModel::rate(const Eigen::Vector3d& h, const DriftTime& time, const double* coefficients) const {
  using Eq1 = Esg7::Coefficients<double>;
  Eq1 kappa = Eigen::Map<const Eq1>(coefficients);
  int column = size_;
  using Eigen::Vector3d;
  Vector3d beside = Vector3d::Zero();  // drift that does not depend on the direction
  if (wandering_) {
    beside = Eigen::Map<const Vector3d>(coefficients + column);
    column += 3;
  }
  if (change_) {
    kappa += time.part_of_change * Eigen::Map<const Eq1>(coefficients + column);
    column += Esg7::kSize;
  }
  if (orbital_) {
    beside += time.orbital_sine * Eigen::Map<const Vector3d>(coefficients + column) +
              time.orbital_cosine * Eigen::Map<const Vector3d>(coefficients + column + 3);
    column += Layout::kOrbitalDrift;
  }
  if (polhode_) {
    kappa += time.polhode_sine * Eigen::Map<const Eq1>(coefficients + column) +
             time.polhode_cosine * Eigen::Map<const Eq1>(coefficients + column + Esg7::kSize);
  }
  Vector3d rate = Esg7::rate<double>(h, kappa) + beside;
  if (size_ > Esg7::kSize) {
    const auto harmonics = harmonics_.at<double>(h);
    using Sum = HarmonicTableOf<DriftModelId::kMaxDegree>::At<double>::Sum;
    Sum w(harmonics);
    Sum d(harmonics);
    double of_cube = 0;
    for (int i = Esg7::kSize; i < size_; ++i) {
      const DriftCoefficient& its = member(i);
      const double factor = coefficients[i];
      if (its.member == Member::kCubeD) {
        of_cube = factor;
      } else if (BesideK0::is(its)) {
        w.add(4, 4, BesideK0::kOf44 * factor);
        w.add(4, 0, BesideK0::kOf40 * factor);
      } else {
        (its.member == Member::kW ? w : d).add(its.degree, its.order, factor);
      }
    }
    rate += h.cross(d.gradient() + of_cube * h.cwiseProduct(h).cwiseProduct(h)) - w.gradient();
  }
  return rate;
}

}  // namespace trihedron
