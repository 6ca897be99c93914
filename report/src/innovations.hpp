#pragma once
/// Fixes as the filter saw them.

#include <cmath>
#include <vector>

#include "trihedron/records/run.hpp"

namespace trihedron::report {

/// Components of eq. (3) from the second on: two per gyro.
[[nodiscard]] inline std::size_t innovations_of(const CalibrationRun& run) { return 2 * run.calibration.gyros.size(); }

/// Calls body(component, innovation / sigma) for the fixes that the filter judged and used.
template <class Body>
void for_each_normalised(const std::vector<FixRecord>& fixes, Body&& body) {
  for (const FixRecord& fix : fixes) {
    for (std::size_t i = 0; fix.status == FixStatus::kUsed && i < fix.innovation.size(); ++i) {
      if (const double value = fix.innovation[i] / fix.innovation_sigma[i]; std::isfinite(value)) {
        body(i, value);
      }
    }
  }
}

}  // namespace trihedron::report
