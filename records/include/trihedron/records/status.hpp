#pragma once
/// What was done with samples, fixes and gyros: names and counts.

#include <array>
#include <string_view>
#include <vector>

#include "trihedron/core/status.hpp"

namespace trihedron {

/// A status and its name.
template <class Status>
struct StatusRow {
  Status status;
  std::string_view name;  ///< for people, and of a count
};

inline constexpr std::array<StatusRow<FixStatus>, kFixStatuses> kFixStatusRows = {{
    {FixStatus::kNone, "none"},
    {FixStatus::kPending, "pending"},
    {FixStatus::kStarted, "started the filter"},
    {FixStatus::kUsed, "used"},
    {FixStatus::kUsedAfterReopening, "used after reopening"},
    {FixStatus::kRestarted, "used, filter restarted"},
    {FixStatus::kRejectedNotRotation, "rejected: not a rotation"},
    {FixStatus::kRejectedOutOfOrder, "rejected: out of order"},
    {FixStatus::kRejectedNoGyro, "rejected: no gyro samples round it"},
    {FixStatus::kRejectedUnknownHead, "rejected: of an unknown star tracker"},
    {FixStatus::kRejectedBacklog, "rejected: too many waiting"},
    {FixStatus::kRejectedGeometry, "rejected: momenta nearly parallel"},
    {FixStatus::kRejectedTooFewGyros, "rejected: too few gyros can be used"},
    {FixStatus::kRejectedByGate, "rejected: outlier"},
    {FixStatus::kEstimateLost, "rejected: estimate was not finite and was dropped"},
    {FixStatus::kRejectedFrozen, "rejected: star tracker frozen"},
    {FixStatus::kUsedAfterWidening, "used after widening"},
}};

inline constexpr std::array<StatusRow<SampleStatus>, kSampleStatuses> kSampleStatusRows = {{
    {SampleStatus::kNone, "none"},
    {SampleStatus::kUsed, "used"},
    {SampleStatus::kRejectedNotDirection, "rejected: not a direction"},
    {SampleStatus::kRejectedOutOfOrder, "rejected: out of order"},
    {SampleStatus::kRejectedGeometry, "rejected: momenta nearly parallel"},
    {SampleStatus::kRejectedTooFewGyros, "rejected: too few gyros can be used"},
    {SampleStatus::kUsedAfterClockSetBack, "used after the clock was set back"},
    {SampleStatus::kThinned, "thinned: more per second than are used"},
}};

inline constexpr std::array<StatusRow<GyroState>, kGyroStates> kGyroStateRows = {{
    {GyroState::kUsed, "used again"},
    {GyroState::kStuck, "stuck"},
    {GyroState::kIsolated, "left out for good"},
    {GyroState::kNotSelected, "left out by command"},
    {GyroState::kLeapt, "leapt"},
}};

/// Its name in the table.
[[nodiscard]] constexpr std::string_view name_of(FixStatus status) {
  return kFixStatusRows[static_cast<std::size_t>(status)].name;
}
/// Its name in the table.
[[nodiscard]] constexpr std::string_view name_of(SampleStatus status) {
  return kSampleStatusRows[static_cast<std::size_t>(status)].name;
}
/// Its name in the table.
[[nodiscard]] constexpr std::string_view name_of(GyroState state) {
  return kGyroStateRows[static_cast<std::size_t>(state)].name;
}

/// Whether it was not used, for whatever reason; not of kNone and kPending.
[[nodiscard]] constexpr bool is_rejected(FixStatus status) { return status >= FixStatus::kRejectedNotRotation; }
/// Whether it was not used, for whatever reason.
[[nodiscard]] constexpr bool is_rejected(SampleStatus status) { return !is_used(status); }

/// How many there were of each status.
template <class Status, std::size_t Size>
class CountsByStatus {
 public:
  [[nodiscard]] constexpr long& operator[](Status status) { return counts_[static_cast<std::size_t>(status)]; }
  [[nodiscard]] constexpr long operator[](Status status) const { return counts_[static_cast<std::size_t>(status)]; }

 private:
  std::array<long, Size> counts_{};
};

using SampleCounts = CountsByStatus<SampleStatus, kSampleStatusRows.size()>;

/// How many fixes there were of each status.
struct FixCounts : CountsByStatus<FixStatus, kFixStatusRows.size()> {
  long lost_to_clock = 0;  ///< discarded because the clock was set back while they waited
};

/// A count with the name of what is counted.
struct NamedCount {
  std::string_view name;
  long count = 0;
  bool is_rejected = false;
};

/// Those that are not zero, in the order of their names.
[[nodiscard]] std::vector<NamedCount> named_counts(const SampleCounts& counts);
/// The same of fixes.
[[nodiscard]] std::vector<NamedCount> named_counts(const FixCounts& counts);

}  // namespace trihedron
