#include "trihedron/core/snapshot.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <vector>

#include "application_flight.hpp"
#include "trihedron/core/crc32.hpp"

namespace trihedron {
namespace {

using Store = SnapshotStore<PairApplication>;
using Memory = std::vector<std::byte>;

/// A state so small that a test can damage it in every way.
struct Small {
  static constexpr std::uint32_t kSnapshotLayout = 7;
  std::array<std::uint8_t, 100> bytes{};
};
struct Other : Small {
  static constexpr std::uint32_t kSnapshotLayout = 8;
};
using SmallStore = SnapshotStore<Small>;
constexpr std::size_t kSmallSlot = SmallStore::kSlotSize;

Small small(std::uint8_t value) {
  Small state;
  for (std::size_t i = 0; i < state.bytes.size(); ++i) {
    state.bytes[i] = static_cast<std::uint8_t>(value + 3 * i);
  }
  return state;
}
std::span<const std::byte> bytes(const char* text) { return std::as_bytes(std::span(text, std::strlen(text))); }
void flip(Memory& memory, std::size_t bit) { memory[bit / 8] ^= std::byte(1U << bit % 8); }

TEST(Crc32, HasItsCheckValue) {
  EXPECT_EQ(crc32(bytes("123456789")), 0xCBF43926U);
  EXPECT_EQ(crc32({}), 0U);
  EXPECT_EQ(crc32(bytes("The quick brown fox jumps over the lazy dog")), 0x414FA339U);
}

TEST(Crc32, OfPartsIsThatOfTheWhole) {
  const auto whole = bytes("The quick brown fox jumps over the lazy dog");
  for (std::size_t cut = 0; cut <= whole.size(); ++cut) {
    EXPECT_EQ(crc32(whole.subspan(cut), crc32(whole.first(cut))), crc32(whole)) << cut;
  }
}

TEST(Snapshot, AlternatesBetweenSlotsAndRestoresTheNewest) {
  Memory memory(SmallStore::kSize);
  for (std::uint8_t n = 1; n <= 5; ++n) {
    EXPECT_EQ(SmallStore::save(small(n), memory), n);
    Small state;
    const auto restored = SmallStore::restore(memory, state);
    EXPECT_EQ(restored.sequence, n);
    EXPECT_EQ(state.bytes, small(n).bytes);
    const std::size_t newest = n % 2 == 1 ? 0 : 1;
    EXPECT_EQ(restored.slots[newest], SnapshotAnswer::kRestored);
    EXPECT_EQ(restored.slots[1 - newest], n == 1 ? SnapshotAnswer::kForeign : SnapshotAnswer::kOlder);
  }
}

TEST(Snapshot, IsNotFoundInMemoryThatWasNeverWritten) {
  for (const std::byte value : {std::byte{0}, std::byte{0xFF}, std::byte{0xA5}}) {
    const Memory memory(SmallStore::kSize, value);
    Small state = small(9);
    const auto restored = SmallStore::restore(memory, state);
    EXPECT_FALSE(restored.ok());
    EXPECT_EQ(restored.slots[0], SnapshotAnswer::kForeign);
    EXPECT_EQ(restored.slots[1], SnapshotAnswer::kForeign);
    EXPECT_EQ(state.bytes, small(9).bytes);
  }
}

TEST(Snapshot, NeedsMemoryForTwoSlots) {
  Memory memory(SmallStore::kSize - 1);
  EXPECT_EQ(SmallStore::save(small(1), memory), 0U);
  Small state;
  EXPECT_EQ(SmallStore::restore(memory, state).slots[0], SnapshotAnswer::kTooSmall);
}

TEST(Snapshot, WithAnyBitFlippedIsRefusedAndTheOtherTaken) {
  Memory memory(SmallStore::kSize);
  SmallStore::save(small(1), memory);
  SmallStore::save(small(2), memory);  // in the second slot
  for (std::size_t bit = 8 * kSmallSlot; bit < 8 * SmallStore::kSize; ++bit) {
    flip(memory, bit);
    Small state;
    const auto restored = SmallStore::restore(memory, state);
    EXPECT_TRUE(restored.slots[1] == SnapshotAnswer::kForeign || restored.slots[1] == SnapshotAnswer::kCorrupted)
        << bit;
    EXPECT_EQ(restored.sequence, 1U) << bit;
    EXPECT_EQ(state.bytes, small(1).bytes);
    flip(memory, bit);
  }
}

TEST(Snapshot, WithoutASequenceNumberIsNoSnapshot) {
  Memory memory(SmallStore::kSize);
  SmallStore::save(small(1), memory);
  const Small other = small(2);
  detail::write_slot(std::span(memory).subspan(kSmallSlot), Small::kSnapshotLayout, 0,
                     std::as_bytes(std::span(&other, 1)));
  Small state;
  const auto restored = SmallStore::restore(memory, state);
  EXPECT_EQ(restored.slots[1], SnapshotAnswer::kCorrupted);
  EXPECT_EQ(state.bytes, small(1).bytes);
}

TEST(Snapshot, TornAnywhereIsRefusedAndTheOtherTaken) {
  Memory before(SmallStore::kSize);
  SmallStore::save(small(1), before);
  SmallStore::save(small(2), before);
  Memory after = before;
  SmallStore::save(small(3), after);  // in the first slot
  for (const bool from_the_end : {false, true}) {
    for (std::size_t written = 0; written < kSmallSlot; ++written) {
      Memory torn = before;
      const std::size_t first = from_the_end ? kSmallSlot - written : 0;
      std::copy_n(after.begin() + static_cast<std::ptrdiff_t>(first), written,
                  torn.begin() + static_cast<std::ptrdiff_t>(first));
      Small state;
      const auto restored = SmallStore::restore(torn, state);
      EXPECT_EQ(restored.sequence, torn == after ? 3U : 2U) << written;
      EXPECT_EQ(state.bytes, small(torn == after ? 3 : 2).bytes);
    }
  }
}

TEST(Snapshot, OfAnotherStateIsForeign) {
  Memory memory(SmallStore::kSize);
  SmallStore::save(small(1), memory);
  Other other;
  EXPECT_EQ(SnapshotStore<Other>::restore(memory, other).slots[0], SnapshotAnswer::kForeign);
  // Of a machine with the other byte order, each number of the header is turned round.
  Memory turned = memory;
  for (std::size_t first = 0; first < 8; first += 4) {
    std::reverse(turned.begin() + static_cast<std::ptrdiff_t>(first),
                 turned.begin() + static_cast<std::ptrdiff_t>(first + 4));
  }
  Small state;
  EXPECT_EQ(SmallStore::restore(turned, state).slots[0], SnapshotAnswer::kForeign);
}

TEST(Snapshot, IsWrittenOverADamagedOneFirst) {
  Memory memory(SmallStore::kSize);
  SmallStore::save(small(1), memory);
  SmallStore::save(small(2), memory);
  flip(memory, 8 * (kSmallSlot + 60));  // the newest, in the second slot
  EXPECT_EQ(SmallStore::save(small(3), memory), 2U);
  Small state;
  EXPECT_EQ(SmallStore::restore(memory, state).sequence, 2U);
  EXPECT_EQ(state.bytes, small(3).bytes);
}

// ---- Of the application

class SnapshotOfApplication : public ::testing::Test {
 protected:
  const test::Flight flight{{.duration_s = 1800}};
  Memory memory = Memory(Store::kSize);

  /// A snapshot at this time; and what it was at the end of the flight.
  Housekeeping fly_with_snapshot_at(double t_s) {
    const auto application = test::started<PairApplication>(test::nominal_parameters());
    test::fly_from(flight, 0, t_s, *application);
    Store::save(*application, memory);
    test::fly_from(flight, t_s, 1e9, *application);
    return application->housekeeping();
  }
};

TEST_F(SnapshotOfApplication, GoesOnBitForBit) {
  // Between events of all kinds: waiting, aligning, a fix that waits for its samples, navigating.
  for (const double t_s : {0.0, 0.1, 2.0, 31.3, 600.0, 601.0, 1501.6}) {
    const Housekeeping whole = fly_with_snapshot_at(t_s);
    // Into an object with other contents.
    auto again = test::started<PairApplication>(test::nominal_parameters());
    test::fly_from(flight, 0, 77, *again);
    ASSERT_TRUE(Store::restore(memory, *again).ok());
    test::fly_from(flight, t_s, 1e9, *again);
    const Housekeeping restored = again->housekeeping();
    EXPECT_EQ(whole.mode, static_cast<std::uint8_t>(Mode::kNavigating));
    EXPECT_EQ(std::memcmp(&restored, &whole, sizeof whole), 0) << t_s;
  }
}

TEST_F(SnapshotOfApplication, InTheMiddleOfAFixGoesOnBitForBit) {
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  test::fly_from(flight, 0, 1500, *application);
  for (double t_s = 1500; t_s < 1503; t_s += 0.125) {
    Store::save(*application, memory);
    auto again = test::started<PairApplication>(test::nominal_parameters());
    ASSERT_TRUE(Store::restore(memory, *again).ok());
    PairApplication whole = *application;
    test::fly_from(flight, t_s, t_s + 60, whole);
    test::fly_from(flight, t_s, t_s + 60, *again);
    const Housekeeping expected = whole.housekeeping();
    const Housekeeping restored = again->housekeeping();
    EXPECT_EQ(std::memcmp(&restored, &expected, sizeof expected), 0) << t_s;
    EXPECT_EQ(whole.on_board().estimator().gyros()[0].h_in, again->on_board().estimator().gyros()[0].h_in) << t_s;
    test::fly_from(flight, t_s, t_s + 0.125, *application);
  }
}

TEST_F(SnapshotOfApplication, WithABitFlippedInAnyByteIsRefused) {
  fly_with_snapshot_at(100);
  PairApplication application;
  for (std::size_t byte = 0; byte < Store::kSlotSize; byte += byte < sizeof(SnapshotHeader) ? 1 : 7) {
    const std::size_t bit = 8 * byte + byte % 8;
    flip(memory, bit);
    EXPECT_FALSE(Store::restore(memory, application).ok()) << byte;
    flip(memory, bit);
  }
  EXPECT_TRUE(Store::restore(memory, application).ok());
}

TEST_F(SnapshotOfApplication, WithAnyBitFlippedIsRefused) {
  fly_with_snapshot_at(100);
  PairApplication application;
  for (std::size_t bit = 0; bit < 8 * Store::kSlotSize; ++bit) {
    flip(memory, bit);
    ASSERT_FALSE(Store::restore(memory, application).ok()) << bit;
    flip(memory, bit);
  }
}

TEST_F(SnapshotOfApplication, OfThreeGyrosIsForeignToTwo) {
  using Trio = SnapshotStore<TrioApplication>;
  Memory of_three(Trio::kSize);
  const auto trio = test::started<TrioApplication>(test::nominal_parameters(3));
  Trio::save(*trio, of_three);
  PairApplication application;
  EXPECT_EQ(Store::restore(of_three, application).slots[0], SnapshotAnswer::kForeign);
}

}  // namespace
}  // namespace trihedron
