#include "trihedron/records/readiness.hpp"

#include <gtest/gtest.h>

namespace trihedron {
namespace {

Housekeeping record() {
  Housekeeping its{};
  its.attitude_valid = its.predicted = its.adopted = 1;
  its.required_error_rad = 1.4544410433e-3;
  its.ready_s = 16200;
  return its;
}

TEST(Readiness, IsASentence) {
  EXPECT_EQ(readiness_in_words(record()), "attitude within 5′ for the next 270 min (99.7 %)");
  Housekeeping its = record();
  its.required_error_rad /= 10;
  EXPECT_EQ(readiness_in_words(its), "attitude within 30″ for the next 270 min (99.7 %)");
  its.adopted = 0;
  EXPECT_EQ(readiness_in_words(its), "if adopted, attitude within 30″ for the next 270 min (99.7 %)");
}

TEST(Readiness, RunsOutFromTheLastCorrectionOn) {
  Housekeeping its = record();
  its.corrected_ns = 1'000'000'000'000;
  its.time_ns = its.corrected_ns + 16000'000'000'000;
  EXPECT_EQ(readiness_s(its), 200);
  EXPECT_EQ(readiness_in_words(its), "attitude within 5′ for the next 3 min (99.7 %)");
  its.time_ns += 300'000'000'000;
  EXPECT_EQ(readiness_s(its), 0);
  EXPECT_EQ(readiness_in_words(its), "attitude not within 5′ without the star tracker (99.7 %)");
}

TEST(Readiness, PromisesNothingWhereNothingIsKnown) {
  Housekeeping its = record();
  its.predicted = 0;
  EXPECT_EQ(readiness_s(its), 0);
  EXPECT_EQ(readiness_in_words(its), "not yet known: the stretch for a prediction has not been flown");
  its.attitude_valid = 0;
  EXPECT_EQ(readiness_in_words(its), "no attitude");
}

}  // namespace
}  // namespace trihedron
