#include "trihedron/ground/application/play.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace trihedron::ground {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

TEST(Durations, HavePercentilesOfTheirSize) {
  std::mt19937_64 random(1);
  std::lognormal_distribution<double> distribution(9, 3);
  std::vector<std::int64_t> all;
  Durations durations;
  for (int i = 0; i < 20000; ++i) {
    all.push_back(static_cast<std::int64_t>(distribution(random)));
    durations.add(nanoseconds(all.back()));
  }
  std::ranges::sort(all);
  EXPECT_EQ(durations.count(), all.size());
  EXPECT_EQ(durations.longest(), nanoseconds(all.back()));
  for (const double part : {0.01, 0.1, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const auto exact = all[static_cast<std::size_t>(std::ceil(part * 20000)) - 1];
    const auto found = nanoseconds(durations.percentile(part)).count();
    EXPECT_GE(found, exact) << part;
    EXPECT_LE(static_cast<double>(found), 1.016 * static_cast<double>(exact) + 1) << part;
  }
}

TEST(Durations, OfNoneAndOfExtremes) {
  Durations durations;
  EXPECT_EQ(durations.percentile(0.5), nanoseconds(0));
  durations.add(nanoseconds(-5));
  EXPECT_EQ(durations.percentile(1), nanoseconds(0));
  durations.add(nanoseconds::max());
  EXPECT_EQ(durations.percentile(1), nanoseconds::max());
}

TEST(Pace, IsThatOfTheTelemetryTimesTheSpeed) {
  const Clock::time_point begin = Clock::now();
  const Time t = Time(seconds(1000));
  Pace pace(4);
  EXPECT_EQ(pace.until(t, begin), milliseconds(0));
  EXPECT_EQ(pace.until(t + seconds(2), begin), milliseconds(500));
  EXPECT_EQ(pace.until(t + seconds(2), begin + milliseconds(450)), milliseconds(50));
  EXPECT_EQ(pace.until(t + seconds(2), begin + seconds(1)), milliseconds(-500));
  Pace at_once(kAtOnce);
  EXPECT_EQ(at_once.until(t + seconds(2), begin), milliseconds(0));
}

}  // namespace
}  // namespace trihedron::ground
