#pragma once
/// Fixes that wait for the readings around them.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "trihedron/core/assert.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// In the order of their times; there is room for the fixes of kStarTrackers at 20 Hz with gyros at 1 Hz, whose
/// readings come up to 5 s later. Covariances of the fixes are kept where kCovariances says so.
template <int kStarTrackers, bool kCovariances = false>
class FixQueue {
 public:
  static constexpr int kCapacity = 100 * kStarTrackers;

  [[nodiscard]] int size() const { return size_; }
  /// Of the first; Time::max() where none waits.
  [[nodiscard]] Time next_t() const { return size_ > 0 ? time(0) : Time::max(); }

  /// How many of them are not later than `t`; at most `most`.
  [[nodiscard]] int count_until(Time t, int most) const {
    int count = 0;
    while (count < std::min(size_, most) && time(count) <= t) {
      ++count;
    }
    return count;
  }

  /// kPending, or why it cannot wait.
  [[nodiscard]] FixStatus push(const StarFix& fix) {
    int place = size_;
    while (place > 0 && time(place - 1) > fix.t) {
      --place;
    }
    for (int i = place; i > 0 && time(i - 1) == fix.t; --i) {
      if (heads_[slot(i - 1)] == fix.head) {
        return FixStatus::kRejectedOutOfOrder;  // repeated
      }
    }
    if (size_ == kCapacity) {
      return FixStatus::kRejectedBacklog;
    }
    for (int i = size_; i > place; --i) {
      times_[slot(i)] = times_[slot(i - 1)];
      heads_[slot(i)] = heads_[slot(i - 1)];
      q_in_c_[slot(i)] = q_in_c_[slot(i - 1)];
      if constexpr (kCovariances) {
        covariances_[slot(i)] = covariances_[slot(i - 1)];
      }
    }
    times_[slot(place)] = fix.t;
    heads_[slot(place)] = static_cast<std::int8_t>(fix.head);
    std::copy_n(fix.q_in_c.coeffs().data(), fix.q_in_c.coeffs().size(), q_in_c_[slot(place)].begin());
    if constexpr (kCovariances) {
      covariances_[slot(place)] = fix.covariance;
    }
    ++size_;
    return FixStatus::kPending;
  }

  /// The first of them; needs one.
  [[nodiscard]] StarFix pop() {
    TRIHEDRON_ASSERT(size_ > 0);
    const std::size_t its = slot(0);
    StarFix fix{times_[its], Eigen::Quaterniond(q_in_c_[its].data()), heads_[its], {}};
    if constexpr (kCovariances) {
      fix.covariance = covariances_[its];
    }
    first_ = (first_ + 1) % kCapacity;
    --size_;
    return fix;
  }

  /// Forgets all of them; their number.
  int clear() {
    const int dropped = size_;
    size_ = 0;
    return dropped;
  }

 private:
  [[nodiscard]] std::size_t slot(int i) const { return static_cast<std::size_t>((first_ + i) % kCapacity); }
  [[nodiscard]] Time time(int i) const { return times_[slot(i)]; }

  // Apart, without the gaps that alignment would leave between them.
  template <class T>
  using Slots = std::array<T, static_cast<std::size_t>(kCapacity)>;
  Slots<std::array<double, 4>> q_in_c_{};
  Slots<Time> times_{};
  Slots<std::int8_t> heads_{};
  struct None {};
  [[no_unique_address]] std::conditional_t<kCovariances, Slots<FixCovariance>, None> covariances_{};
  int first_ = 0;
  int size_ = 0;
};

}  // namespace trihedron
