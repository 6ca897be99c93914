// trihedron_feed PASS FEED [HOURS]: writes the feed of a pass, as flight/targets/feed.hpp describes it: what the
// on-board object of a pair is set up with, eq. (1) and no further states, and the first hours of events as replay()
// feeds them.

#include <fmt/format.h>

#include <cstdlib>
#include <exception>
#include <optional>

#include "../targets/feed.hpp"
#include "model/prior.hpp"
#include "model/setup.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron {
namespace {

using targets::Event;
using targets::EventKind;

CalibrationOptions options_of_pair() {
  CalibrationOptions options;
  options.drift_model = kEsg7;
  options.further_states = FurtherStateOptions::none();
  return options;
}

targets::GivenToFlight given_for(const PassSettings& settings) {
  const CalibrationOptions options = options_of_pair();
  targets::GivenToFlight given;
  given.setup = ground::setup_of(settings, options);
  if (!kPairCapacity.holds(given.setup.layout)) {
    throw ground::SetupError("the pass is not of one pair of gyros and one star tracker", "give the pass of a pair");
  }
  const ground::Prior prior = ground::prior_of(settings, given.setup.layout);
  for (int k = 0; k < given.setup.layout.gyros; ++k) {
    GyroReadout& readout = given.prior[k];
    readout = prior.gyros[k];
    given.prior[k].drift_rad_s = prior.gyros[k].drift_rad_s;
  }
  given.covariance.topLeftCorner(prior.covariance.rows(), prior.covariance.cols()) = prior.covariance;
  given.policy = ground::policy_of(options.corrections);
  return given;
}

/// In time order, a fix on the time of a gyro sample after it.
template <class Put>
void for_each_event(const Pass& pass, Duration duration, Put&& put) {
  const StarTrackerTelemetry& fixes = pass.star_tracker;
  std::size_t next_fix = 0;
  const auto put_fixes_before = [&](Time t) {
    for (; next_fix < fixes.size() && fixes.t[next_fix] < t; ++next_fix) {
      const Eigen::Quaterniond& q = fixes.q_in_c[next_fix];
      put(Event{EventKind::kFix, fixes.t[next_fix], {q.x(), q.y(), q.z(), q.w(), 0, 0}});
    }
  };
  for (std::size_t i = 0; i < pass.gyro.size() && pass.gyro.t[i] - pass.settings.epoch <= duration; ++i) {
    const GyroSample sample = sample_of(pass.gyro, i);
    put_fixes_before(sample.t);
    const Eigen::Vector3d& h1 = sample.h_b[0];
    const Eigen::Vector3d& h2 = sample.h_b[1];
    put(Event{EventKind::kGyro, sample.t, {h1.x(), h1.y(), h1.z(), h2.x(), h2.y(), h2.z()}});
  }
}

bool write_feed(const Pass& pass, const char* path, Duration duration) {
  targets::WordWriter words(path);
  targets::ToFeed each(words);
  std::uint64_t format = targets::kFeedFormat;
  each(format);
  targets::GivenToFlight given = given_for(pass.settings);
  exchange(each, given);
  for_each_event(pass, duration, [&](Event event) { exchange(each, event); });
  Event end;
  exchange(each, end);
  return words.close();
}

}  // namespace
}  // namespace trihedron

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    fmt::print(stderr, "usage: trihedron_feed PASS FEED [HOURS]\n");
    return 2;
  }
  try {
    const trihedron::Duration duration =
        argc == 4 ? trihedron::from_seconds(3600 * std::strtod(argv[3], nullptr)) : trihedron::Duration::max();
    const trihedron::Pass pass = trihedron::io::read_pass(argv[1]).pass;
    if (!trihedron::write_feed(pass, argv[2], duration)) {
      fmt::print(stderr, "trihedron_feed: {} could not be written\n", argv[2]);
      return 4;
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "trihedron_feed: {}\n", error.what());
    return 3;
  }
  return 0;
}
