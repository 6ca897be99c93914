#include "trihedron/sim/harmonics.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

namespace trihedron::sim {

HarmonicTable::HarmonicTable(int max_degree) : max_degree_(max_degree) {
  if (!(max_degree >= 0 && max_degree <= kMaxDegree)) {
    throw std::invalid_argument("spherical harmonics: the degree must be 0 … 20");
  }
  diagonal_[0] = std::sqrt(0.25 / std::numbers::pi);
  for (int m = 1; m <= max_degree; ++m) {
    // The factor √2 of the sines and cosines against the zonal harmonics comes in once, at m = 1.
    const double ratio = m == 1 ? 3.0 : (2.0 * m + 1) / (2.0 * m);
    diagonal_[static_cast<std::size_t>(m)] = std::sqrt(ratio) * diagonal_[static_cast<std::size_t>(m) - 1];
  }
  for (int l = 1; l <= max_degree; ++l) {
    for (int m = 0; m < l; ++m) {
      const double ll = l;
      const double mm = m;
      const std::size_t i = index(l, m);
      up_[i] = std::sqrt((4 * ll * ll - 1) / (ll * ll - mm * mm));
      if (l > m + 1) {
        const double k = ll - 1;
        up_two_[i] = up_[i] * std::sqrt((k * k - mm * mm) / (4 * k * k - 1));
      }
      slope_[i] = m == 0 ? std::sqrt(ll * (ll + 1) / 2) : std::sqrt((ll - mm) * (ll + mm + 1));
    }
  }
}

namespace {
int checked_max_degree(const std::vector<DriftHarmonic>& members) {
  int degree = 0;
  for (const DriftHarmonic& member : members) {
    if (!(member.degree >= 1 && member.degree <= HarmonicTable::kMaxDegree &&
          std::abs(member.order) <= member.degree)) {
      throw std::invalid_argument("drift harmonic " + name(member) + ": the degree must be 1 … 20, |order| ≤ degree");
    }
    degree = std::max(degree, member.degree);
  }
  return degree;
}
}  // namespace

HarmonicField::HarmonicField(std::vector<DriftHarmonic> members)
    : members_(std::move(members)), table_(checked_max_degree(members_)) {
  for (const DriftHarmonic& member : members_) {
    const int order = std::abs(member.order);
    auto term = std::ranges::find_if(
        terms_, [&](const Term& candidate) { return candidate.degree == member.degree && candidate.order == order; });
    if (term == terms_.end()) {
      term = terms_.insert(term, {member.degree, order});
    }
    auto& amplitudes = member.potential == DriftHarmonic::Potential::kW ? term->w : term->d;
    amplitudes[member.order < 0 ? 1U : 0U] += member.amplitude_rad_s;
  }
}

std::vector<DriftHarmonic> members_outside_eq1() {
  using Potential = DriftHarmonic::Potential;
  constexpr std::array<std::pair<int, int>, 6> kDegreeOrder = {{{1, -1}, {1, 0}, {1, 1}, {2, -2}, {2, -1}, {2, 1}}};
  std::vector<DriftHarmonic> members;
  for (const Potential potential : {Potential::kW, Potential::kD}) {
    for (const auto& [degree, order] : kDegreeOrder) {
      members.push_back({potential, degree, order, 0});
    }
  }
  return members;
}

std::string name(const DriftHarmonic& member) {
  const char* potential = member.potential == DriftHarmonic::Potential::kW ? "W(" : "D(";
  return potential + std::to_string(member.degree) + "," + std::to_string(member.order) + ")";
}

}  // namespace trihedron::sim
