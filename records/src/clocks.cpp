#include "trihedron/records/clocks.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace trihedron {
namespace {

/// The readings of one gyro at the stamps of all from `from` on and before `until`, from those that it gave `late_s`
/// later.
void interpolate(GyroTelemetry& telemetry, int gyro, double late_s, Duration period, Time from = Time::min(),
                 Time until = Time::max()) {
  const Duration farthest = 3 * period / 2;
  const std::vector<double> given = telemetry.h;
  const auto place = [&](std::size_t sample) {
    return (sample * static_cast<std::size_t>(telemetry.gyros) + static_cast<std::size_t>(gyro)) * 3;
  };
  std::size_t after = 0;
  for (std::size_t i = 0; i < telemetry.size(); ++i) {
    if (telemetry.t[i] < from || telemetry.t[i] >= until) {
      continue;
    }
    const Time t = telemetry.t[i] + from_seconds(late_s);
    while (after < telemetry.size() && telemetry.t[after] < t) {
      ++after;
    }
    const bool is_between =
        after > 0 && after < telemetry.size() && telemetry.t[after] - telemetry.t[after - 1] <= farthest;
    const double part =
        is_between ? to_seconds(telemetry.t[after] - t) / to_seconds(telemetry.t[after] - telemetry.t[after - 1])
                   : std::numeric_limits<double>::quiet_NaN();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      telemetry.h[place(i) + axis] =
          is_between ? part * given[place(after - 1) + axis] + (1 - part) * given[place(after) + axis] : part;
    }
  }
}

}  // namespace

bool ClockCorrection::of_gyros() const {
  return std::ranges::any_of(late_s, [](double late) { return late != 0; });
}

void correct(Pass& pass, const ClockCorrection& correction) {
  if (correction.of_star_tracker()) {
    const auto mend = [&](StarTrackerTelemetry& fixes) {
      for (Time& t : fixes.t) {
        t = pass.settings.epoch + from_seconds(correction.true_s(to_seconds(t - pass.settings.epoch)));
      }
    };
    mend(pass.star_tracker);
    std::ranges::for_each(pass.further_star_trackers, mend);
  }
  for (int k = 0; k < std::min(pass.gyro.gyros, kMaxGyros); ++k) {
    if (correction.late_s[k] != 0) {
      interpolate(pass.gyro, k, correction.late_s[k], pass.settings.gyro_period);
    }
  }
}

void correct(Pass& pass, const ClockStep& step) {
  if (step.gyro >= 0) {
    interpolate(pass.gyro, step.gyro, step.change_s.value, pass.settings.gyro_period, step.from, step.until);
    return;
  }
  const auto mend = [&](StarTrackerTelemetry& fixes) {
    StarTrackerTelemetry mended;
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      const bool is_off = fixes.t[i] >= step.from && fixes.t[i] < step.until;
      const Time t = fixes.t[i] + (is_off ? from_seconds(step.change_s.value) : Duration{});
      if (mended.t.empty() || t > mended.t.back()) {
        mended.add(fixes, i);
        mended.t.back() = t;
      }
    }
    fixes = std::move(mended);
  };
  mend(pass.star_tracker);
  std::ranges::for_each(pass.further_star_trackers, mend);
}

}  // namespace trihedron
