#include "trihedron/core/drift.hpp"

#include <algorithm>
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

constexpr int kMaxDegreeOfEq1 = 4;

constexpr int max_degree_of(DriftModelId id) {
  constexpr int kEsg20Degree = 2;
  return id.family == DriftModelId::Family::kVsh     ? id.degree
         : id.family == DriftModelId::Family::kEsg20 ? kEsg20Degree
                                                     : 0;
}

/// How many members of a degree and potential a model has: all orders that are not in eq. (1).
constexpr int members_of(Member potential, int degree) {
  int count = 2 * degree + 1;
  for (int order = -degree; order <= degree && degree <= kMaxDegreeOfEq1; ++order) {
    count -= is_in_eq1(potential, degree, order) ? 1 : 0;
  }
  return count;
}

/// Calls work(degree, w, d) for each degree of a model: the first columns of its members W and of its members D.
template <class Work>
void for_each_degree(DriftModelId id, const Work& work) {
  constexpr int kAllOfEsg20 = members_of(Member::kW, 1) + members_of(Member::kW, 2);  // W before D
  const int max_degree = max_degree_of(id);
  int w = Esg7::kSize;
  for (int degree = 1; degree <= max_degree; ++degree) {
    const int so_many = members_of(Member::kW, degree);
    const int d = w + (id == kEsg20 ? kAllOfEsg20 : so_many);
    work(degree, w, d);
    w = id == kEsg20 ? w + so_many : d + members_of(Member::kD, degree);
  }
}

using Harmonics = HarmonicTableOf<DriftModelId::kMaxDegree>::At<double>;
using ByOrder = Harmonics::ByOrder;
/// Of W(4, 0) and W(4, 4) among all orders of their degree.
constexpr std::size_t kPlaceOf40 = 4;
constexpr std::size_t kPlaceOf44 = 8;

/// Puts the numbers of all orders of a degree, from −degree on, into the columns of its members, from `to` on.
void put_members(Member potential, int degree, const ByOrder& numbers, double* to) {
  if (degree > kMaxDegreeOfEq1) {
    std::copy_n(numbers.data(), 2 * degree + 1, to);
    return;
  }
  std::size_t place = 0;
  for (int order = -degree; order <= degree; ++order) {
    if (!is_in_eq1(potential, degree, order)) {
      *to++ = numbers[place];
    }
    ++place;
  }
}

/// The coefficients of all orders of a degree, from −degree on, of those of its members, which begin at `from`.
/// `room`: where they lie if they do not as they are.
const double* by_order(Member potential, int degree, const double* from, ByOrder& room) {
  if (degree > kMaxDegreeOfEq1) {
    return from;
  }
  std::size_t place = 0;
  for (int order = -degree; order <= degree; ++order) {
    room[place] = is_in_eq1(potential, degree, order) ? 0.0 : *from++;
    ++place;
  }
  if (potential == Member::kW && degree == BesideK0::kDegree) {
    const double its = room[kPlaceOf44];
    room[kPlaceOf40] = BesideK0::kOf40 * its;
    room[kPlaceOf44] = BesideK0::kOf44 * its;
  }
  return room.data();
}

}  // namespace

DriftModel::DriftModel(DriftModelId id, const FurtherStates& further)
    : harmonics_(max_degree_of(id)),
      id_(id),
      size_(static_cast<std::int16_t>(id.size())),
      wandering_(further.wandering_drift),
      change_(further.coefficient_change),
      orbital_(further.orbital_drift),
      polhode_(further.polhode) {
  for (int number = 0; number < Esg7::kSize; ++number) {
    members_[static_cast<std::size_t>(number)] = DriftCoefficient::of_eq1(number);
  }
  const auto add = [this](Member potential, int degree, int column) {
    for (int order = -degree; order <= degree; ++order) {
      if (!is_in_eq1(potential, degree, order)) {
        members_[static_cast<std::size_t>(column++)] = {potential, static_cast<std::int8_t>(degree),
                                                        static_cast<std::int8_t>(order)};
      }
    }
  };
  for_each_degree(id, [&](int degree, int w, int d) {
    add(Member::kW, degree, w);
    add(Member::kD, degree, d);
  });
  if (id == kEsg20) {
    members_[static_cast<std::size_t>(size_ - 1)] = {Member::kCubeD, 0, 0};
  }
}

/// The columns of members beside eq. (1).
void DriftModel::put_beside_eq1(const Eigen::Vector3d& h, ColumnsView B) const {
  const Harmonics harmonics = harmonics_.at<double>(h);
  for_each_degree(id_, [&](int degree, int w, int d) {
    const auto [x, y, z] = harmonics.polynomial_gradients_by_order(degree);
    std::array<ByOrder, 3> of_w;
    std::array<ByOrder, 3> of_d;
    for (std::size_t i = 0; static_cast<int>(i) < 2 * degree + 1; ++i) {
      of_w[0][i] = -x[i];
      of_w[1][i] = -y[i];
      of_w[2][i] = -z[i];
      of_d[0][i] = h.y() * z[i] - h.z() * y[i];
      of_d[1][i] = h.z() * x[i] - h.x() * z[i];
      of_d[2][i] = h.x() * y[i] - h.y() * x[i];
    }
    for (int i = 0; i < 3; ++i) {
      ByOrder& its_w = of_w[static_cast<std::size_t>(i)];
      if (degree == BesideK0::kDegree) {
        double& of_44 = its_w[kPlaceOf44];
        of_44 = BesideK0::kOf44 * of_44 + BesideK0::kOf40 * its_w[kPlaceOf40];
      }
      put_members(Member::kW, degree, its_w, B.row(i) + w);
      put_members(Member::kD, degree, of_d[static_cast<std::size_t>(i)], B.row(i) + d);
    }
  });
  if (id_ == kEsg20) {
    B.set_column(size_ - 1, h.cross(h.cwiseProduct(h).cwiseProduct(h)));
  }
}

/// What they add to the rate.
Eigen::Vector3d DriftModel::rate_beside_eq1(const Eigen::Vector3d& h, const double* coefficients) const {
  const Harmonics harmonics = harmonics_.at<double>(h);
  Harmonics::Sum w_sum(harmonics);
  Harmonics::Sum d_sum(harmonics);
  for_each_degree(id_, [&](int degree, int w, int d) {
    const Harmonics::Degree its = harmonics.of_degree(degree);
    ByOrder room;
    w_sum.add(its, by_order(Member::kW, degree, coefficients + w, room));
    d_sum.add(its, by_order(Member::kD, degree, coefficients + d, room));
  });
  const double of_cube = id_ == kEsg20 ? coefficients[size_ - 1] : 0;
  return h.cross(d_sum.gradient() + of_cube * h.cwiseProduct(h).cwiseProduct(h)) - w_sum.gradient();
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
    put_beside_eq1(h, B);
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
    rate += rate_beside_eq1(h, coefficients);
  }
  return rate;
}

}  // namespace trihedron
