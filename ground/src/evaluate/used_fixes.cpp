#include "trihedron/ground/evaluate/used_fixes.hpp"

#include <algorithm>

namespace trihedron::ground {

StarTrackerTelemetry used_fixes(const Pass& pass, const std::vector<FixRecord>& fixes) {
  // A record comes when the fix is dealt with, which for a good one is later than for a bad one.
  std::vector<Time> times;
  for (const FixRecord& fix : fixes) {
    if (fix.used() && fix.head == 0) {
      times.push_back(fix.t);
    }
  }
  std::ranges::sort(times);
  StarTrackerTelemetry used;
  for (std::size_t i = 0; i < pass.star_tracker.size(); ++i) {
    const Time t = pass.star_tracker.t[i];
    const Eigen::Quaterniond& q_in_c = pass.star_tracker.q_in_c[i];
    const bool repeated = !used.t.empty() && used.t.back() == t;
    if (!repeated && q_in_c.coeffs().allFinite() && std::ranges::binary_search(times, t)) {
      used.t.push_back(t);
      used.q_in_c.push_back(q_in_c);
    }
  }
  return used;
}

}  // namespace trihedron::ground
