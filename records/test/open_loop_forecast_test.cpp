#include "trihedron/records/open_loop_forecast.hpp"

#include <gmock/gmock.h>

#include <chrono>

namespace trihedron {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;

TEST(OpenLoopForecast, IsToldInWords) {
  EXPECT_EQ(time_in_words(seconds(59)), "less than a minute");
  EXPECT_EQ(time_in_words(seconds(179)), "2 min");
  EXPECT_EQ(time_in_words(minutes(119)), "119 min");
  EXPECT_EQ(time_in_words(minutes(380)), "6 h 20 min");
  EXPECT_EQ(time_in_words(hours(9)), "9 h");
  constexpr double kFiveArcminutes = 5 * 2.908882086657216e-4;
  EXPECT_EQ(in_words(AccuracyForecast{kFiveArcminutes, minutes(380), false}),
            "attitude within 5′ for 6 h 20 min after a correction (99.7 %)");
  EXPECT_EQ(in_words(AccuracyForecast{kFiveArcminutes, hours(24), true}),
            "attitude within 5′ for 24 h and longer after a correction (99.7 %)");
  EXPECT_EQ(in_words(AccuracyForecast{kFiveArcminutes, seconds(20), false}),
            "attitude not within 5′ even after a correction (99.7 %)");
  EXPECT_EQ(in_words(Need{kFiveArcminutes / 10, minutes(90)}), "30″ for 90 min");
}

}  // namespace
}  // namespace trihedron
