#include "trihedron/ground/tasks/on_all_cores.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace trihedron::ground {
namespace {

TEST(OnAllCores, GivesTheResultsInTheirOrder) {
  const std::vector<double> squares = on_all_cores(100, [](std::size_t i) { return static_cast<double>(i * i); });
  ASSERT_EQ(squares.size(), 100U);
  for (std::size_t i = 0; i < squares.size(); ++i) {
    EXPECT_EQ(squares[i], static_cast<double>(i * i));
  }
  EXPECT_TRUE(on_all_cores(0, [](std::size_t) { return 0; }).empty());
}

TEST(OnAllCores, ThrowsWhatTheWorkThrows) {
  const auto work = [](std::size_t i) {
    if (i == 3) {
      throw std::invalid_argument("three");
    }
    return i;
  };
  EXPECT_THROW((void)on_all_cores(10, work), std::invalid_argument);
}

TEST(OnAllCores, BeginsNoMoreAfterAFailure) {
  int begun = 0;
  const auto work = [&](std::size_t i) {
    ++begun;
    throw std::invalid_argument("at once");
    return i;
  };
  EXPECT_THROW((void)on_all_cores(10, work, 1), std::invalid_argument);
  EXPECT_EQ(begun, 1);
}

}  // namespace
}  // namespace trihedron::ground
