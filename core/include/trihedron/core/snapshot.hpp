#pragma once
/// Snapshots of a state, in memory of the caller that survives a restart: two slots, so that one is whole while the
/// other is being written. docs/adr/0014-on-board-application.md.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "trihedron/core/tables.hpp"

namespace trihedron {

/// What stands before the state in a slot. In the machine's own byte order, so that of another one is refused by its
/// magic number.
struct SnapshotHeader {
  static constexpr std::uint32_t kMagic = 0x54524944;

  std::uint32_t magic = 0;
  std::uint32_t layout = 0;  ///< which state, and which version of it
  std::uint64_t sequence = 0;
  std::uint64_t size = 0;  ///< of the state, bytes
  std::uint32_t reserved = 0;
  std::uint32_t crc = 0;  ///< crc32() of all before it in the header, and then of the state
};
static_assert(sizeof(SnapshotHeader) == 32);

namespace detail {

/// What a slot holds: kRestored if it is whole. With its sequence number.
struct SlotContent {
  SnapshotAnswer answer = SnapshotAnswer::kForeign;
  std::uint64_t sequence = 0;
};
[[nodiscard]] SlotContent look_into(std::span<const std::byte> slot, std::uint32_t layout);
void write_slot(std::span<std::byte> slot, std::uint32_t layout, std::uint64_t sequence,
                std::span<const std::byte> state);

}  // namespace detail

/// Two slots for a State, which is a plain object: no pointers, nothing to destroy, all that there is to it are its
/// bytes. State::kSnapshotLayout tells one kind and version of it from all others. The store has no state of its own.
template <class State>
class SnapshotStore {
 public:
  static_assert(std::is_trivially_destructible_v<State>);
  static constexpr std::size_t kSlotSize = sizeof(SnapshotHeader) + sizeof(State);
  /// Bytes of memory that are needed; of any alignment.
  static constexpr std::size_t kSize = 2 * kSlotSize;

  /// Writes a snapshot to the slot that does not hold the newest whole one; its sequence number, 1 for the first, or 0
  /// where the memory is too small.
  static std::uint64_t save(const State& state, std::span<std::byte> memory) {
    if (memory.size() < kSize) {
      return 0;
    }
    const Found found = look(memory);
    const std::uint64_t sequence = std::max(found.of(0), found.of(1)) + 1;
    detail::write_slot(slot(memory, found.newest() == 0 ? 1 : 0), State::kSnapshotLayout, sequence,
                       std::as_bytes(std::span(&state, 1)));
    return sequence;
  }

  /// What each slot holds: kRestored the newest whole one, kOlder the other one where it is whole too.
  struct Restored {
    std::array<SnapshotAnswer, 2> slots{SnapshotAnswer::kTooSmall, SnapshotAnswer::kTooSmall};
    std::uint64_t sequence = 0;  ///< of the one restored; 0: none, and nothing is changed

    [[nodiscard]] bool ok() const { return sequence != 0; }
  };
  [[nodiscard]] static Restored restore(std::span<const std::byte> memory, State& state) {
    Restored restored;
    if (memory.size() < kSize) {
      return restored;
    }
    const Found found = look(memory);
    restored.slots = {found.slots[0].answer, found.slots[1].answer};
    const int newest = found.newest();
    if (newest < 0) {
      return restored;
    }
    auto& other = restored.slots[newest == 0 ? 1 : 0];
    other = other == SnapshotAnswer::kRestored ? SnapshotAnswer::kOlder : other;
    restored.sequence = found.of(newest);
    const auto bytes = slot(memory, newest).subspan(sizeof(SnapshotHeader));
    std::memcpy(std::as_writable_bytes(std::span(&state, 1)).data(), bytes.data(), bytes.size());
    return restored;
  }

 private:
  struct Found {
    std::array<detail::SlotContent, 2> slots;

    /// 0 where the slot is not whole.
    [[nodiscard]] std::uint64_t of(int i) const {
      const detail::SlotContent& its = slots[static_cast<std::size_t>(i)];
      return its.answer == SnapshotAnswer::kRestored ? its.sequence : 0;
    }
    /// −1: neither is whole.
    [[nodiscard]] int newest() const { return of(0) == 0 && of(1) == 0 ? -1 : of(0) > of(1) ? 0 : 1; }
  };
  template <class Byte>
  [[nodiscard]] static std::span<Byte> slot(std::span<Byte> memory, int i) {
    return memory.subspan(static_cast<std::size_t>(i) * kSlotSize, kSlotSize);
  }
  [[nodiscard]] static Found look(std::span<const std::byte> memory) {
    return {{detail::look_into(slot(memory, 0), State::kSnapshotLayout),
             detail::look_into(slot(memory, 1), State::kSnapshotLayout)}};
  }
};

}  // namespace trihedron
