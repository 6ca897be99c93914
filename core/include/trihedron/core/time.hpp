#pragma once
/// Time in the flight library: int64 nanoseconds TAI. There is no clock here; every time comes from telemetry.

#include <chrono>
#include <cstdint>

namespace trihedron {

/// Tag of the TAI time scale, counted from 1958-01-01T00:00:00 TAI; ± 292 years. It has no now().
struct Tai {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = std::chrono::duration<rep, period>;
  using time_point = std::chrono::time_point<Tai>;
  static constexpr bool is_steady = false;
};

using Time = Tai::time_point;
using Duration = Tai::duration;

/// Times farther from the origin, 146 years, are not accepted, so that the difference of any two can be told.
inline constexpr Duration kMaxTime = Duration::max() / 2;

/// t + shift, or ±kMaxTime where that would be passed. |t| ≤ kMaxTime.
[[nodiscard]] constexpr Time shifted(Time t, Duration shift) {
  const Duration since = t.time_since_epoch();
  if (shift > Duration::zero()) {
    return since > kMaxTime - shift ? Time(kMaxTime) : t + shift;
  }
  return since < -kMaxTime - shift ? Time(-kMaxTime) : t + shift;
}

/// Correctly rounded: 3 s is 3.0 and not its neighbour, so that files show what was meant.
[[nodiscard]] constexpr double to_seconds(Duration d) { return static_cast<double>(d.count()) / 1e9; }

/// Nearest whole nanosecond; |seconds| must be below 9.2e9.
[[nodiscard]] constexpr Duration from_seconds(double seconds) {
  const double ns = seconds * 1e9;
  return Duration(static_cast<std::int64_t>(ns < 0 ? ns - 0.5 : ns + 0.5));
}

}  // namespace trihedron
