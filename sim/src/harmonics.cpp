#include "trihedron/sim/harmonics.hpp"

#include <algorithm>
#include <utility>

namespace trihedron::sim {
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

}  // namespace trihedron::sim
