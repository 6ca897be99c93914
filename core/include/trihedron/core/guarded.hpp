#pragma once
/// A state kept twice, so that a bit that radiation flips in memory is found and put right before the state is used
/// again.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "trihedron/core/crc32.hpp"

namespace trihedron {

/// What a check has found.
enum class GuardFinding : std::uint8_t {
  kWhole,
  kStateRepaired,  ///< the state was damaged; it has been copied back
  kCopyRepaired,   ///< the copy was damaged
  kLost,           ///< both are: only a snapshot or a reset helps
};

/// The state, a copy of it, and the CRC-32 that tells which of the two is right when they differ. Any error that does
/// not hit both is repaired bit for bit; one that does is found. To be placed so that state and copy are not in one
/// memory device, where there are two.
template <class State>
class Guarded {
 public:
  static_assert(std::is_trivially_destructible_v<State>);

  Guarded() { seal(); }
  explicit Guarded(const State& state) : state_(state) { seal(); }

  /// Compares state and copy, and repairs what is damaged.
  GuardFinding check() {
    const auto state = bytes_of(state_);
    const auto copy = bytes_of(copy_);
    if (std::memcmp(state.data(), copy.data(), state.size()) == 0) {
      return GuardFinding::kWhole;
    }
    if (crc32(copy) == crc_) {
      std::memcpy(state.data(), copy.data(), state.size());
      return GuardFinding::kStateRepaired;
    }
    if (crc32(state) == crc_) {
      std::memcpy(copy.data(), state.data(), state.size());
      return GuardFinding::kCopyRepaired;
    }
    return GuardFinding::kLost;
  }

  /// check(), and unless all is lost f(State&): a sample, a fix or a command.
  template <class F>
  GuardFinding use(F&& f) {
    const GuardFinding found = check();
    if (found != GuardFinding::kLost) {
      f(state_);
      seal();
    }
    return found;
  }

  /// Another state in place of this one, such as that of a snapshot.
  void replace(const State& state) {
    state_ = state;
    seal();
  }

  /// To be read after use() or check().
  [[nodiscard]] const State& state() const { return state_; }

 private:
  [[nodiscard]] static std::span<std::byte> bytes_of(State& state) {
    return std::as_writable_bytes(std::span(&state, 1));
  }
  void seal() {
    const auto state = bytes_of(state_);
    std::memcpy(bytes_of(copy_).data(), state.data(), state.size());
    crc_ = crc32(state);
  }

  State state_;
  State copy_;
  std::uint32_t crc_ = 0;
};

}  // namespace trihedron
