#pragma once
/// A replay by the clock.

#include <array>
#include <chrono>
#include <cstdint>
#include <limits>

#include "trihedron/ground/application/application_replay.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {

using Clock = std::chrono::steady_clock;

/// Many durations, of which percentiles are asked for: counted in classes 1/64 of their size wide, so that any number
/// of them takes the same memory.
class Durations {
 public:
  void add(Clock::duration duration);
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// The duration that this part of them, 0 … 1, does not exceed, to 1.6 %; zero where there is none.
  [[nodiscard]] Clock::duration percentile(double part) const;
  [[nodiscard]] Clock::duration longest() const { return longest_; }

 private:
  static constexpr std::size_t kClassesPerDoubling = 64;
  static constexpr std::size_t kClasses = kClassesPerDoubling * 58;
  [[nodiscard]] static std::size_t class_of(std::uint64_t ns);
  [[nodiscard]] static std::uint64_t most_of(std::size_t its_class);

  std::array<std::uint64_t, kClasses> counts_{};
  std::uint64_t count_ = 0;
  Clock::duration longest_{};
};

/// What the clock shows of a replay.
struct Timing {
  Durations calls;  ///< of what a flight computer does with an event: the call, and the attitude
  Durations late;   ///< how much later than its time an event was fed; with a finite speed
};

/// The speed at which events are fed as fast as they can be.
inline constexpr double kAtOnce = std::numeric_limits<double>::infinity();

/// When events are due.
class Pace {
 public:
  /// `speed`: times that of the telemetry, above zero.
  explicit Pace(double speed) : speed_(speed) {}
  /// How long until an event of this time is due, of which the first asked for is due at once; negative where it is
  /// late. Zero with kAtOnce.
  [[nodiscard]] Clock::duration until(Time t, Clock::time_point now);

 private:
  double speed_;
  bool begun_ = false;
  Time first_{};
  Clock::time_point begun_at_;
};

/// Waits, but not longer than a stop or a look at the screen may.
void wait_for(Clock::duration duration);

/// Feeds all events that are left, each when it is due. Calls on_step(step) after each, and now_and_then(now) after
/// each and while it waits. Can be stopped.
template <class OnStep, class NowAndThen>
void play(ApplicationReplay& replay, double speed, Timing& timing, OnStep&& on_step, NowAndThen&& now_and_then) {
  Pace pace(speed);
  while (const auto t = replay.next_t()) {
    check_stop();
    Clock::time_point now = Clock::now();
    Clock::duration wait = pace.until(*t, now);
    while (wait > Clock::duration::zero()) {
      now_and_then(now);
      wait_for(wait);
      check_stop();
      now = Clock::now();
      wait = pace.until(*t, now);
    }
    if (speed != kAtOnce) {
      timing.late.add(-wait);
    }
    const ApplicationReplay::Step& step = replay.feed();
    const Clock::time_point done = Clock::now();
    timing.calls.add(done - now);
    on_step(step);
    now_and_then(done);
  }
}

}  // namespace trihedron::ground
