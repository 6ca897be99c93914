#include "trihedron/core/guarded.hpp"

#include <gtest/gtest.h>

#include <array>

namespace trihedron {
namespace {

struct Numbers {
  std::array<std::uint32_t, 8> its{1, 2, 3, 4, 5, 6, 7, 8};
};
using GuardedNumbers = Guarded<Numbers>;

void flip_bit(GuardedNumbers& guarded, std::size_t bit) {
  std::as_writable_bytes(std::span(&guarded, 1))[bit / 8] ^= std::byte(1U << bit % 8);
}
constexpr std::size_t kBitsOfState = 8 * sizeof(Numbers);

TEST(Guarded, RepairsAnySingleBit) {
  for (std::size_t bit = 0; bit < 8 * sizeof(GuardedNumbers); ++bit) {
    GuardedNumbers guarded;
    flip_bit(guarded, bit);
    const GuardFinding expected = bit < kBitsOfState       ? GuardFinding::kStateRepaired
                                  : bit < 2 * kBitsOfState ? GuardFinding::kCopyRepaired
                                                           : GuardFinding::kWhole;  // of the CRC
    Numbers seen;
    EXPECT_EQ(guarded.use([&](Numbers& numbers) {
      seen = numbers;
      ++numbers.its[3];
    }),
              expected)
        << bit;
    EXPECT_EQ(seen.its, Numbers{}.its) << bit;
    EXPECT_EQ(guarded.check(), GuardFinding::kWhole) << bit;
    EXPECT_EQ(guarded.state().its[3], 5U);
  }
}

TEST(Guarded, DoesNotUseWhatIsLost) {
  GuardedNumbers guarded;
  flip_bit(guarded, 5);
  flip_bit(guarded, kBitsOfState + 77);
  EXPECT_EQ(guarded.use([](Numbers&) { FAIL(); }), GuardFinding::kLost);
  guarded.replace(Numbers{});
  EXPECT_EQ(guarded.check(), GuardFinding::kWhole);
  EXPECT_EQ(guarded.state().its, Numbers{}.its);
}

}  // namespace
}  // namespace trihedron
