#include "batch/rotor_drift.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace trihedron::ground {

using Eigen::Vector3d;
namespace {

/// 1/n.
constexpr std::array<double, 9> kInverse = {0, 1, 1.0 / 2, 1.0 / 3, 1.0 / 4, 1.0 / 5, 1.0 / 6, 1.0 / 7, 1.0 / 8};
static_assert(kInverse.size() == DriftModelId::kMaxDegree + 1);

}  // namespace

RotorDrift::RotorDrift(const DriftModel& model, const double* coefficients) {
  eq1_ = Eigen::Map<const Esg7::Coefficients<double>>(coefficients);
  if (model.orbital_column() > model.change_column()) {
    change_ = Eigen::Map<const Esg7::Coefficients<double>>(coefficients + model.change_column());
  }
  if (model.polhode_column() > model.orbital_column()) {
    orbital_sine_ = Eigen::Map<const Vector3d>(coefficients + model.orbital_column());
    orbital_cosine_ = Eigen::Map<const Vector3d>(coefficients + model.orbital_column() + 3);
  }
  if (model.columns() > model.polhode_column()) {
    polhode_sine_ = Eigen::Map<const Esg7::Coefficients<double>>(coefficients + model.polhode_column());
    polhode_cosine_ = Eigen::Map<const Esg7::Coefficients<double>>(coefficients + model.polhode_column() + Esg7::kSize);
  }
  for (int i = Esg7::kSize; i < model.size(); ++i) {
    const DriftCoefficient& its = model.member(i);
    if (its.member == DriftCoefficient::Member::kCubeD) {
      cube_d_ = coefficients[i];
      continue;
    }
    if (BesideK0::is(its)) {
      add(its.member, 4, 4, BesideK0::kOf44 * coefficients[i]);
      add(its.member, 4, 0, BesideK0::kOf40 * coefficients[i]);
    } else {
      add(its.member, its.degree, its.order, coefficients[i]);
    }
  }
}

void RotorDrift::add(DriftCoefficient::Member potential, int degree, int order, double amplitude) {
  const int m = std::abs(order);
  // Of d^m P_l / dz^m.
  const double norm = std::sqrt((2 * degree + 1) / (4 * std::numbers::pi) * (m > 0 ? 2 : 1) *
                                std::tgamma(degree - m + 1) / std::tgamma(degree + m + 1));
  const int place = (potential == DriftCoefficient::Member::kW ? 0 : 2) + (order < 0 ? 1 : 0);
  outside_[static_cast<std::size_t>(m)][static_cast<std::size_t>(degree)][place] += norm * amplitude;
  degree_ = std::max(degree_, degree);
}

Vector3d RotorDrift::rate(const Vector3d& h, const DriftTime& time) const {
  const Esg7::Coefficients<double> eq1 =
      eq1_ + time.part_of_change * change_ + time.polhode_sine * polhode_sine_ + time.polhode_cosine * polhode_cosine_;
  Vector3d rate =
      Esg7::rate<double>(h, eq1) + time.orbital_sine * orbital_sine_ + time.orbital_cosine * orbital_cosine_;
  if (cube_d_ != 0) {
    rate += cube_d_ * h.cross(h.cwiseProduct(h).cwiseProduct(h));
  }
  if (degree_ == 0) {
    return rate;
  }
  const auto degree = static_cast<std::size_t>(degree_);
  const double z = h.z();
  Vector3d w = Vector3d::Zero();  // ∇W
  Vector3d d = Vector3d::Zero();
  // From the highest order on, because the slope of d^m P_l / dz^m is that of the next order.
  std::array<double, kOrders + 1> above{};  // of each degree
  std::array<double, kOrders> re{1};
  std::array<double, kOrders> im{};
  for (std::size_t m = 1; m <= degree; ++m) {
    re[m] = h.x() * re[m - 1] - h.y() * im[m - 1];
    im[m] = h.x() * im[m - 1] + h.y() * re[m - 1];
  }
  double diagonal = 1;  // (2 m − 1)!!
  for (std::size_t m = 1; m <= degree; ++m) {
    diagonal *= static_cast<double>(2 * m - 1);
  }
  for (std::size_t m = degree + 1; m-- > 0;) {
    std::array<double, kOrders + 1> q{};
    OfOrder value{};
    OfOrder slope{};
    const auto order = static_cast<double>(m);
    q[m] = diagonal;
    for (std::size_t l = m; l <= degree; ++l) {
      if (l > m) {
        const auto ll = static_cast<double>(l);
        q[l] = ((2 * ll - 1) * z * q[l - 1] - (l > m + 1 ? (ll + order - 1) * q[l - 2] : 0)) * kInverse[l - m];
      }
      const OfOrder& its = outside_[m][l];
      value += q[l] * its;
      slope += above[l] * its;
    }
    if (m > 0) {
      const double re_below = order * re[m - 1];
      const double im_below = order * im[m - 1];
      w.x() += value[0] * re_below + value[1] * im_below;
      w.y() += value[1] * re_below - value[0] * im_below;
      d.x() += value[2] * re_below + value[3] * im_below;
      d.y() += value[3] * re_below - value[2] * im_below;
      diagonal /= static_cast<double>(2 * m - 1);
    }
    w.z() += slope[0] * re[m] + slope[1] * im[m];
    d.z() += slope[2] * re[m] + slope[3] * im[m];
    above = q;
  }
  return rate + h.cross(d) - w;
}

}  // namespace trihedron::ground
