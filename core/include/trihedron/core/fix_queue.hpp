#pragma once
/// Fixes that wait for the readings around them.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "trihedron/core/assert.hpp"
#include "trihedron/core/status.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// In the order of their times; there is room for the fixes of kStarTrackers at 20 Hz with gyros at 1 Hz, whose
/// readings come up to 5 s later.
template <int kStarTrackers>
class FixQueue {
 public:
  static constexpr int kCapacity = 100 * kStarTrackers;

  [[nodiscard]] int size() const { return size_; }
  /// Of the first; Time::max() where none waits.
  [[nodiscard]] Time next_t() const { return size_ > 0 ? slot(0).t : Time::max(); }

  /// kPending, or why it cannot wait.
  [[nodiscard]] FixStatus push(const StarFix& fix) {
    int place = size_;
    while (place > 0 && slot(place - 1).t > fix.t) {
      --place;
    }
    for (int i = place; i > 0 && slot(i - 1).t == fix.t; --i) {
      if (slot(i - 1).head == fix.head) {
        return FixStatus::kRejectedOutOfOrder;  // repeated
      }
    }
    if (size_ == kCapacity) {
      return FixStatus::kRejectedBacklog;
    }
    for (int i = size_; i > place; --i) {
      slot(i) = slot(i - 1);
    }
    Slot& its = slot(place);
    its.t = fix.t;
    its.head = fix.head;
    std::copy_n(fix.q_in_c.coeffs().data(), its.q_in_c.size(), its.q_in_c.begin());
    ++size_;
    return FixStatus::kPending;
  }

  /// The first of them; needs one.
  [[nodiscard]] StarFix pop() {
    TRIHEDRON_ASSERT(size_ > 0);
    const Slot& its = slot(0);
    const StarFix fix{its.t, Eigen::Quaterniond(its.q_in_c.data()), its.head};
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
  /// A StarFix without the gaps that alignment leaves in one.
  struct Slot {
    std::array<double, 4> q_in_c{};
    Time t{};
    int head = 0;
  };
  [[nodiscard]] Slot& slot(int i) { return slots_[static_cast<std::size_t>((first_ + i) % kCapacity)]; }
  [[nodiscard]] const Slot& slot(int i) const { return slots_[static_cast<std::size_t>((first_ + i) % kCapacity)]; }

  std::array<Slot, static_cast<std::size_t>(kCapacity)> slots_{};
  int first_ = 0;
  int size_ = 0;
};

}  // namespace trihedron
