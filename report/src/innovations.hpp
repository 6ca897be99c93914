#pragma once
/// Fixes as the filter saw them.

#include <cmath>
#include <vector>

#include "trihedron/ground/calibrate.hpp"

namespace trihedron::report {

/// Components 2–5 of eq. (3).
inline constexpr std::size_t kInnovations = 4;

/// Calls body(component, innovation / sigma) for the fixes that the filter judged and used.
template <class Body>
void for_each_normalised(const std::vector<ground::FixRecord>& fixes, Body&& body) {
  for (const ground::FixRecord& fix : fixes) {
    for (std::size_t i = 0; i < kInnovations && fix.status == FixStatus::kUsed; ++i) {
      if (const double value = fix.innovation[i] / fix.innovation_sigma[i]; std::isfinite(value)) {
        body(i, value);
      }
    }
  }
}

}  // namespace trihedron::report
