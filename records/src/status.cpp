#include "trihedron/records/status.hpp"

#include <algorithm>

namespace trihedron {
namespace {

constexpr std::string_view kLostToClock = "rejected: clock set back while it waited";

template <class Rows, class Counts>
std::vector<NamedCount> counted(const Rows& rows, const Counts& counts) {
  std::vector<NamedCount> named;
  for (const auto& row : rows) {
    if (counts[row.status] > 0) {
      named.push_back({row.name, counts[row.status], is_rejected(row.status)});
    }
  }
  return named;
}

}  // namespace

std::vector<NamedCount> named_counts(const SampleCounts& counts) {
  std::vector<NamedCount> named = counted(kSampleStatusRows, counts);
  std::ranges::sort(named, {}, &NamedCount::name);
  return named;
}

std::vector<NamedCount> named_counts(const FixCounts& counts) {
  std::vector<NamedCount> named = counted(kFixStatusRows, counts);
  if (counts.lost_to_clock > 0) {
    named.push_back({kLostToClock, counts.lost_to_clock, true});
  }
  std::ranges::sort(named, {}, &NamedCount::name);
  return named;
}

}  // namespace trihedron
