#include "model/drift_family.hpp"

#include <algorithm>
#include <cmath>

namespace trihedron::ground {
namespace {

using Member = DriftCoefficient::Member;

constexpr double kOutsideEq1 = 0.05;

}  // namespace

DriftFamily::DriftFamily(const DriftModelId& model)
    : model_(model), coefficients_(coefficients_of(model)), table_(kMaxDegree) {}

double DriftFamily::prior_factor(int coefficient) const {
  if (coefficient < Esg7::kSize) {
    return 1;
  }
  if (model_ == kEsg20) {
    return kOutsideEq1;
  }
  const int degree = std::max(int{coefficients_[static_cast<std::size_t>(coefficient)].degree}, 2);
  return kOutsideEq1 * std::sqrt(6.0 / (degree * (degree + 1)));
}

DriftFamily::Basis DriftFamily::basis(const Eigen::Vector3d& h) const {
  if (model_ == kEsg20) {
    return Esg20::basis<double>(h);
  }
  Basis b(3, size());
  b.leftCols<Esg7::kSize>() = Esg7::basis<double>(h);
  if (size() > Esg7::kSize) {
    const HarmonicTable::At<double> y = table_.at<double>(h);
    for (Eigen::Index i = Esg7::kSize; i < size(); ++i) {
      const DriftCoefficient& member = coefficients_[static_cast<std::size_t>(i)];
      const Eigen::Vector3d slope = y.polynomial_gradient(member.degree, member.order);
      b.col(i) = member.member == Member::kW ? Eigen::Vector3d(-slope) : h.cross(slope);
    }
  }
  return b;
}

}  // namespace trihedron::ground
