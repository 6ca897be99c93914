#include "trihedron/records/pass.hpp"

#include <algorithm>

namespace trihedron {

std::optional<double> Truth::Gyro::drift(const DriftCoefficient& coefficient) const {
  const auto modelled = std::ranges::find(drift_rad_s, coefficient, &std::pair<DriftCoefficient, double>::first);
  if (modelled != drift_rad_s.end()) {
    return modelled->second;
  }
  const auto outside =
      std::ranges::find(unmodelled_rad_s, name_of(coefficient), &std::pair<std::string, double>::first);
  return outside == unmodelled_rad_s.end() ? std::nullopt : std::optional(outside->second);
}

}  // namespace trihedron
