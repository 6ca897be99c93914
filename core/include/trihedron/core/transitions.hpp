#pragma once
/// The modes of the on-board application and what leads from one to the other: one table.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "trihedron/core/tables.hpp"

namespace trihedron {

/// What changes the mode, or may be commanded in it. The first are the commands, with the same numbers.
enum class Event : std::uint8_t {
  kStart,
  kCorrectNow,
  kAdoptCalibration,
  kHoldCalibration,
  kSelectGyros,
  kLoadParameters,
  kReset,
  kFirstFix,         ///< the filter has started
  kAligned,          ///< enough fixes have confirmed the start
  kAdopted,          ///< the navigator uses the calibration
  kTakenBack,        ///< the navigator no longer uses it
  kFilterRestarted,  ///< it contradicted the fixes
  kFault,            ///< one that takes away accuracy or redundancy
  kRecovered,        ///< from all faults
  kFailure,          ///< no attitude for too long
};
inline constexpr std::size_t kEvents = 15;

/// Of a command.
[[nodiscard]] constexpr Event event_of(Command command) { return static_cast<Event>(command); }
static_assert(event_of(Command::kStart) == Event::kStart && event_of(Command::kCorrectNow) == Event::kCorrectNow &&
              event_of(Command::kAdoptCalibration) == Event::kAdoptCalibration &&
              event_of(Command::kHoldCalibration) == Event::kHoldCalibration &&
              event_of(Command::kSelectGyros) == Event::kSelectGyros &&
              event_of(Command::kLoadParameters) == Event::kLoadParameters &&
              event_of(Command::kReset) == Event::kReset && kCommands == 7);

namespace detail {

/// Not allowed, or without effect.
inline constexpr Mode kNo = static_cast<Mode>(kModes);

// clang-format off
/// A row for each event, a column for each mode that it comes in.
inline constexpr std::array<std::array<Mode, kModes>, kEvents> kTransitions = [] {
  using enum Mode;
  return std::array<std::array<Mode, kModes>, kEvents>{{
  //  standby         waiting    aligning      calibrating   navigating    degraded      failed
    {{kWaitingForFix, kNo,       kNo,          kNo,          kNo,          kNo,          kNo}},       // start
    {{kNo,            kNo,       kNo,          kCalibrating, kNavigating,  kDegraded,    kNo}},       // correct now
    {{kNo,            kNo,       kNo,          kCalibrating, kNavigating,  kDegraded,    kNo}},       // adopt calibration
    {{kNo,            kNo,       kNo,          kCalibrating, kNavigating,  kDegraded,    kNo}},       // hold calibration
    {{kNo,            kNo,       kAligning,    kCalibrating, kNavigating,  kDegraded,    kNo}},       // select gyros
    {{kStandby,       kNo,       kNo,          kNo,          kNo,          kNo,          kNo}},       // load parameters
    {{kStandby,       kStandby,  kStandby,     kStandby,     kStandby,     kStandby,     kStandby}},  // reset
    {{kNo,            kAligning, kNo,          kNo,          kNo,          kNo,          kNo}},       // first fix
    {{kNo,            kNo,       kCalibrating, kNo,          kNo,          kNo,          kNo}},       // aligned
    {{kNo,            kNo,       kNo,          kNavigating,  kNo,          kNo,          kNo}},       // adopted
    {{kNo,            kNo,       kNo,          kNo,          kCalibrating, kNo,          kNo}},       // taken back
    {{kNo,            kNo,       kNo,          kAligning,    kAligning,    kAligning,    kNo}},       // filter restarted
    {{kNo,            kNo,       kNo,          kDegraded,    kDegraded,    kNo,          kNo}},       // fault
    {{kNo,            kNo,       kNo,          kNo,          kNo,          kCalibrating, kNo}},       // recovered
    {{kNo,            kFailed,   kFailed,      kFailed,      kFailed,      kFailed,      kNo}},       // failure
  }};
}();
// clang-format on

}  // namespace detail

/// The mode after an event that comes in this mode; nothing where it is not allowed or has no effect.
[[nodiscard]] constexpr std::optional<Mode> next_mode(Mode mode, Event event) {
  const Mode next = detail::kTransitions[static_cast<std::size_t>(event)][static_cast<std::size_t>(mode)];
  return next == detail::kNo ? std::nullopt : std::optional(next);
}

}  // namespace trihedron
