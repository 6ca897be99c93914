#pragma once

#include "trihedron/core/assert.hpp"

namespace trihedron {

/// A value, or the enumerator that names the fault. For set-up and degenerate input; core throws nothing.
template <class T, class Fault>
class [[nodiscard]] Result {
 public:
  // Implicit on purpose: `return value;` and `return Fault::kName;` read as what they are.
  Result(const T& value) : value_(value), ok_(true) {}  // NOLINT(misc-explicit-constructor)
  Result(Fault fault) : fault_(fault) {}                // NOLINT(misc-explicit-constructor)

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] explicit operator bool() const { return ok_; }
  /// The value; asserts ok().
  /// Always inline: g++ would split off the failing branch and merge those of several types into one, and the call
  /// graph would name functions that it has no frame of.
  [[nodiscard]] [[gnu::always_inline]] const T& value() const {
    TRIHEDRON_ASSERT(ok_);
    return value_;
  }
  /// The fault; asserts !ok().
  [[nodiscard]] Fault fault() const {
    TRIHEDRON_ASSERT(!ok_);
    return fault_;
  }

 private:
  T value_{};
  Fault fault_{};
  bool ok_ = false;
};

}  // namespace trihedron
