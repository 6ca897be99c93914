#include "trihedron/ground/onboard/events.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace trihedron::ground {
namespace {

using testing::ElementsAre;

Time at(double t_s) { return Time(from_seconds(t_s)); }

StarTrackerTelemetry fixes_at(const std::vector<double>& t_s) {
  StarTrackerTelemetry tracker;
  for (const double t : t_s) {
    tracker.t.push_back(at(t));
    tracker.q_in_c.push_back(Eigen::Quaterniond::Identity());
  }
  return tracker;
}

/// Samples at 1, 2, 3 s; fixes of two star trackers.
Pass small_pass() {
  Pass pass;
  pass.gyro.gyros = 2;
  pass.gyro.t = {at(1), at(2), at(3)};
  pass.gyro.h.resize(18, 0.5);
  pass.star_tracker = fixes_at({0.5, 2, 2.75, 4});
  pass.further_star_trackers = {fixes_at({2, 2.25})};
  return pass;
}

/// "sample 2", "fix 2.25 of 1"
std::vector<std::string> in_words(Events events) {
  std::vector<std::string> all;
  while (const auto t = events.next_t()) {
    const auto event = events.next();
    const auto text = [&](const Time its, const std::string& what) {
      EXPECT_EQ(its, *t);
      return what + std::to_string(to_seconds(its.time_since_epoch())).substr(0, 4);
    };
    if (const auto* sample = std::get_if<GyroSample>(&*event)) {
      all.push_back(text(sample->t, "sample "));
    } else {
      const auto& fix = std::get<StarFix>(*event);
      all.push_back(text(fix.t, "fix ") + " of " + std::to_string(fix.head));
    }
  }
  EXPECT_FALSE(events.next().has_value());
  return all;
}

TEST(Events, ComeInTimeOrderAFixAfterTheSampleOfItsTime) {
  EXPECT_THAT(in_words(Events(small_pass(), 2)),
              ElementsAre("fix 0.50 of 0", "sample 1.00", "sample 2.00", "fix 2.00 of 0", "fix 2.00 of 1",
                          "fix 2.25 of 1", "fix 2.75 of 0", "sample 3.00", "fix 4.00 of 0"));
}

TEST(Events, AreOfTheStarTrackersThatAreUsed) {
  EXPECT_THAT(in_words(Events(small_pass(), 1)),
              ElementsAre("fix 0.50 of 0", "sample 1.00", "sample 2.00", "fix 2.00 of 0", "fix 2.75 of 0",
                          "sample 3.00", "fix 4.00 of 0"));
}

TEST(Events, GoOnFromAnyPosition) {
  const Pass pass = small_pass();
  const std::vector<std::string> all = in_words(Events(pass, 2));
  Events events(pass, 2);
  for (std::size_t taken = 0; taken <= all.size(); ++taken) {
    EXPECT_EQ(in_words(Events(pass, 2, events.position())),
              std::vector<std::string>(all.begin() + static_cast<std::ptrdiff_t>(taken), all.end()));
    static_cast<void>(events.next());
  }
}

}  // namespace
}  // namespace trihedron::ground
