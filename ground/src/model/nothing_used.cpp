#include "model/nothing_used.hpp"

#include <fmt/format.h>

#include <string>

namespace trihedron::ground {

SetupError nothing_used(const std::vector<FixRecord>& fixes) {
  FixCounts counts;
  for (const FixRecord& fix : fixes) {
    ++counts[fix.status];
  }
  std::string what_became;
  for (const NamedCount& its : named_counts(counts)) {
    what_became += fmt::format("{}{} {}", what_became.empty() ? "" : ", ", its.count, its.name);
  }
  const bool are_parallel = !fixes.empty() && counts[FixStatus::kRejectedGeometry] == std::ssize(fixes);
  return {fmt::format("no fix could be used to start from ({})", what_became.empty() ? "there is none" : what_became),
          are_parallel ? "two momenta on one line give no attitude: start the rotors along other directions, or take "
                         "another pair of gyros"
                       : "look at the telemetry with `trihedron inspect`, of a scenario after `trihedron simulate`"};
}

}  // namespace trihedron::ground
