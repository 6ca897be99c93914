#include "trihedron/ground/application/play.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <thread>

namespace trihedron::ground {

// Below 64 each ns is a class of its own; above, a class has the six bits after the highest in common.
std::size_t Durations::class_of(std::uint64_t ns) {
  if (ns < kClassesPerDoubling) {
    return ns;
  }
  const auto shift = static_cast<std::size_t>(std::bit_width(ns)) - 7;
  return shift * kClassesPerDoubling + (ns >> shift);
}

std::uint64_t Durations::most_of(std::size_t its_class) {
  if (its_class < 2 * kClassesPerDoubling) {
    return its_class;
  }
  const std::size_t shift = its_class / kClassesPerDoubling - 1;
  return ((its_class % kClassesPerDoubling + kClassesPerDoubling + 1) << shift) - 1;
}

void Durations::add(Clock::duration duration) {
  const auto ns = static_cast<std::uint64_t>(std::max<std::int64_t>(std::chrono::nanoseconds(duration).count(), 0));
  ++counts_[class_of(ns)];
  ++count_;
  longest_ = std::max(longest_, duration);
}

Clock::duration Durations::percentile(double part) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(part * static_cast<double>(count_)));
  std::uint64_t so_far = 0;
  for (std::size_t its_class = 0; its_class < kClasses && count_ > 0; ++its_class) {
    so_far += counts_[its_class];
    if (so_far >= wanted) {
      return std::min<Clock::duration>(std::chrono::nanoseconds(most_of(its_class)), longest_);
    }
  }
  return {};
}

Clock::duration Pace::until(Time t, Clock::time_point now) {
  if (speed_ == kAtOnce) {
    return {};
  }
  if (!begun_) {
    begun_ = true;
    first_ = t;
    begun_at_ = now;
  }
  constexpr double kMost_s = 86400;  // what is further off is asked for again
  const double since_s = std::chrono::duration<double>(now - begun_at_).count();
  return from_seconds(std::min(to_seconds(t - first_) / speed_ - since_s, kMost_s));
}

void wait_for(Clock::duration duration) {
  std::this_thread::sleep_for(std::min<Clock::duration>(duration, std::chrono::milliseconds(50)));
}

}  // namespace trihedron::ground
