#include "model/drift_family.hpp"

#include <charconv>
#include <cmath>

namespace trihedron::ground {
namespace {

using Potential = DriftHarmonic::Potential;

constexpr std::string_view kVsh = "vsh:";
constexpr double kOutsideEq1 = 0.05;

/// W and D of Σ a_i h_i²/2 and of h1 h2 h3, and of degree 4 the W of Σ h⁴/4, which is made of (4, 0) and (4, 4).
bool is_in_eq1(Potential potential, int degree, int order) {
  return (degree == 2 && (order == 0 || order == 2)) || (degree == 3 && order == -2) ||
         (degree == 4 && order == 0 && potential == Potential::kW);
}

std::vector<DriftHarmonic> members_outside_eq1(int max_degree) {
  std::vector<DriftHarmonic> members;
  for (int degree = 1; degree <= max_degree; ++degree) {
    for (const Potential potential : {Potential::kW, Potential::kD}) {
      for (int order = -degree; order <= degree; ++order) {
        if (!is_in_eq1(potential, degree, order)) {
          members.push_back({potential, degree, order});
        }
      }
    }
  }
  return members;
}

}  // namespace

std::optional<DriftFamily> DriftFamily::named(std::string_view model) {
  DriftFamily family;
  family.names_ = {Esg7::kNames.begin(), Esg7::kNames.end()};
  if (model == Esg7::kModelName) {
    return family;
  }
  if (model == Esg20::kModelName) {
    family.esg20_ = true;
    family.names_ = {Esg20::kNames.begin(), Esg20::kNames.end()};
    return family;
  }
  if (!model.starts_with(kVsh)) {
    return std::nullopt;
  }
  const std::string_view text = model.substr(kVsh.size());
  int degree = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), degree);
  if (fault != std::errc() || end != text.data() + text.size() || degree < 1 || degree > kMaxDegree) {
    return std::nullopt;
  }
  family.members_ = members_outside_eq1(degree);
  for (const DriftHarmonic& member : family.members_) {
    family.names_.push_back(name(member));
  }
  return family;
}

double DriftFamily::prior_factor(int coefficient) const {
  if (coefficient < Esg7::kSize) {
    return 1;
  }
  if (members_.empty()) {
    return kOutsideEq1;
  }
  const int degree = std::max(members_[static_cast<std::size_t>(coefficient - Esg7::kSize)].degree, 2);
  return kOutsideEq1 * std::sqrt(6.0 / (degree * (degree + 1)));
}

DriftFamily::Basis DriftFamily::basis(const Eigen::Vector3d& h) const {
  if (esg20_) {
    return Esg20::basis<double>(h);
  }
  Basis b(3, size());
  b.leftCols<Esg7::kSize>() = Esg7::basis<double>(h);
  if (!members_.empty()) {
    const HarmonicTable::At<double> y = table_.at<double>(h);
    for (std::size_t i = 0; i < members_.size(); ++i) {
      const DriftHarmonic& member = members_[i];
      const Eigen::Vector3d slope = y.polynomial_gradient(member.degree, member.order);
      b.col(Esg7::kSize + static_cast<Eigen::Index>(i)) =
          member.potential == Potential::kW ? Eigen::Vector3d(-slope) : h.cross(slope);
    }
  }
  return b;
}

}  // namespace trihedron::ground
