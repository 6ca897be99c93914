#pragma once
/// Modes and faults of the on-board application in words.

#include <array>
#include <string_view>

#include "trihedron/core/tables.hpp"

namespace trihedron {

/// By their numbers.
inline constexpr std::array<std::string_view, kModes> kModeNames = {
    "standby", "waiting for a fix", "aligning", "calibrating", "navigating", "degraded", "failed"};

/// A fault and its name.
struct FaultRow {
  Fault fault;
  std::string_view name;
};
inline constexpr std::array<FaultRow, kFaults> kFaultRows = {{{Fault::kStarTrackerLost, "star tracker lost"},
                                                              {Fault::kGyroLost, "gyro lost"},
                                                              {Fault::kNoAttitude, "no attitude"},
                                                              {Fault::kClockSetBack, "clock set back"},
                                                              {Fault::kGap, "gap"},
                                                              {Fault::kAccuracy, "accuracy lost"},
                                                              {Fault::kGyrosContradict, "gyros contradict"},
                                                              {Fault::kFixesContradict, "fixes contradict"}}};

/// Its name in the table.
[[nodiscard]] constexpr std::string_view name_of(Mode mode) { return kModeNames[static_cast<std::size_t>(mode)]; }

}  // namespace trihedron
