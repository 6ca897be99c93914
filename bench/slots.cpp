// What each slot of the on-board application takes: run under callgrind by slots.py, which counts the instructions
// between two of these marks. A slot is a gyro sample, and the fix that comes with it; the calibration has been
// adopted, and the navigator is corrected at each fix where nothing else is said.

#include <valgrind/callgrind.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>

#include "application_flight.hpp"
#include "trihedron/core/guarded.hpp"
#include "trihedron/core/snapshot.hpp"

namespace {

using trihedron::PairApplication;

constexpr double kFrom_s = 450;
constexpr double kCounted_s = 24;
constexpr int kReopenAfter = 20;

/// Where callgrind counts already.
template <class F>
void counted_apart(const std::string& name, F&& f) {
  CALLGRIND_ZERO_STATS;
  f();
  CALLGRIND_DUMP_STATS_AT(name.c_str());
}
template <class F>
void counted(const std::string& name, F&& f) {
  CALLGRIND_START_INSTRUMENTATION;
  counted_apart(name, f);
  CALLGRIND_STOP_INSTRUMENTATION;
}

/// An application that navigates by a calibration of its own, and what comes next.
struct Pass {
  trihedron::test::Flight flight;
  std::unique_ptr<PairApplication> application = std::make_unique<PairApplication>();
  std::size_t sample = 0;
  std::size_t fix = 0;

  Pass(double fix_interval_s, double fix_jitter_s, const trihedron::ApplicationPolicy& policy)
      : flight({.duration_s = kFrom_s + 200, .fix_interval_s = fix_interval_s, .fix_jitter_s = fix_jitter_s}) {
    trihedron::test::PairGiven given;
    given.setup.reopen_after_jump_rejections = kReopenAfter;
    TRIHEDRON_ASSERT(application->load(given.setup, given.prior, given.covariance, policy) ==
                     trihedron::Answer::kAccepted);
    TRIHEDRON_ASSERT(application->command(trihedron::Command::kStart) == trihedron::Answer::kAccepted);
    go_on(kFrom_s);
    TRIHEDRON_ASSERT(application->mode() == trihedron::Mode::kNavigating);
  }

  template <class F>
  void next(F&& use) {
    const auto& its = flight.samples[sample++];
    use([&](PairApplication& application) {
      application.on_gyro(its);
      for (; fix < flight.fixes.size() && flight.fixes[fix].t <= its.t; ++fix) {
        application.on_fix(flight.fixes[fix]);
      }
    });
  }
  /// Samples of so many seconds, not counted.
  void go_on(double time_s) {
    for (const std::size_t end = sample + static_cast<std::size_t>(8 * time_s); sample < end;) {
      next([&](auto&& feed) { feed(*application); });
    }
  }
  void count(const std::string& name) {
    count_with(name, [&](auto&& feed) { feed(*application); });
  }
  template <class F>
  void count_with(const std::string& name, F&& use) {
    count_with(name, kCounted_s, use);
  }
  template <class F>
  void count_with(const std::string& name, double time_s, F&& use) {
    // For all of them at once: valgrind translates the program anew whenever counting begins or ends.
    CALLGRIND_START_INSTRUMENTATION;
    for (int i = 0; i < 8 * time_s; ++i) {
      next([&](auto&& feed) { counted_apart(name, [&] { use(feed); }); });
    }
    CALLGRIND_STOP_INSTRUMENTATION;
  }
  void lose_the_star_tracker() { flight.fixes.resize(fix); }
  /// From the next sample on.
  void set_clock_back(trihedron::Duration by) {
    for (std::size_t i = sample; i < flight.samples.size(); ++i) {
      flight.samples[i].t -= by;
    }
    for (std::size_t i = fix; i < flight.fixes.size(); ++i) {
      flight.fixes[i].t -= by;
    }
  }
  /// The samples of so many seconds are missing, and the fixes between them.
  void lose_samples(int time_s) {
    sample += 8 * static_cast<std::size_t>(time_s);
    while (flight.fixes[fix].t < flight.samples[sample].t) {
      ++fix;
    }
  }
  void lose_two_of_three_fixes(double time_s) {
    const auto end = flight.fixes.begin() + static_cast<std::ptrdiff_t>(fix) + static_cast<std::ptrdiff_t>(time_s);
    int i = 0;
    flight.fixes.erase(std::remove_if(flight.fixes.begin() + static_cast<std::ptrdiff_t>(fix), end,
                                      [&](auto&) { return i++ % 3 != 0; }),
                       end);
  }
  void turn_the_star_tracker(double angle_rad) {
    for (std::size_t i = fix; i < flight.fixes.size(); ++i) {
      flight.fixes[i].q_in_c = flight.fixes[i].q_in_c * Eigen::Quaterniond(trihedron::test::turn(angle_rad, 0, 0));
    }
  }
};

/// With a window and a requirement that are met in minutes.
trihedron::ApplicationPolicy policy_with(int spread_over) {
  trihedron::ApplicationPolicy policy;
  policy.window = std::chrono::minutes(5);
  policy.required_interval = std::chrono::minutes(5);
  policy.required_error_rad = 600 * trihedron::test::kArcsecond;
  policy.spread_over = spread_over;
  return policy;
}

/// Each time at another place in the work of a fix.
template <class Happening>
void count_again_and_again(const std::string& name, Pass pass, Happening&& happen) {
  for (const double after_s : {1.5, 1.625, 2.375, 3.25, 4.0}) {
    pass.go_on(6 + after_s);
    happen(pass);
    pass.count_with(name, 5, [&](auto&& feed) { feed(*pass.application); });
  }
}

/// Of the on-board step, which the application never calls: what is left of a fix, all of it.
template <class Ending>
void count_ending(const std::string& name, Ending&& end) {
  const trihedron::test::Flight flight({.duration_s = 33.5});
  const auto on_board = trihedron::test::PairGiven().on_board({.interval = {}, .spread_over = 20});
  trihedron::test::fly(flight.samples, flight.fixes, *on_board);
  counted(name, [&] { end(*on_board); });
}

void count_others(PairApplication& application) {
  counted("attitude", [&] { static_cast<void>(application.attitude()); });
  counted("housekeeping", [&] { static_cast<void>(application.housekeeping()); });
  const auto guarded = std::make_unique<trihedron::Guarded<PairApplication>>(application);
  counted("guard: check", [&] { guarded->check(); });
  counted("guard: check, copy and CRC", [&] { guarded->use([](PairApplication&) {}); });
  using Store = trihedron::SnapshotStore<PairApplication>;
  const auto memory = std::make_unique<std::array<std::byte, Store::kSize>>();
  counted("snapshot", [&] { Store::save(application, *memory); });
  counted("restoring", [&] { static_cast<void>(Store::restore(*memory, application)); });
  count_ending("carry_on()", [](auto& on_board) { static_cast<void>(on_board.carry_on()); });
  count_ending("flush()", [](auto& on_board) { static_cast<void>(on_board.flush()); });
}

}  // namespace

// One kind of slots, or what else is counted, by its name: each in a process of its own, since callgrind takes the
// longer the more has been counted.
int main(int argc, char** argv) {
  const std::string name = argc == 2 ? argv[1] : "";
  const trihedron::ApplicationPolicy policy = policy_with(trihedron::ApplicationPolicy{}.spread_over);
  if (name == "slot: a fix every 3 s") {
    Pass(3, 0, policy).count(name);
  } else if (name == "slot: a fix every 2.5 to 3 s") {
    Pass(3, 0.5, policy).count(name);
  } else if (name == "slot: a fix every 1 s") {
    Pass(1, 0, policy).count(name);
  } else if (name == "slot: corrected every 90 min") {
    trihedron::ApplicationPolicy seldom = policy;
    seldom.correction_interval = std::chrono::minutes(90);
    Pass(3, 0, seldom).count(name);
  } else if (name == "slot: no star tracker") {
    Pass pass(3, 0, policy);
    pass.lose_the_star_tracker();
    pass.go_on(90);
    pass.count(name);
  } else if (name == "slot: the clock is set back") {
    count_again_and_again(name, Pass(3, 0, policy), [](Pass& its) { its.set_clock_back(std::chrono::seconds(10)); });
  } else if (name == "slot: gaps of the gyros") {
    count_again_and_again(name, Pass(3, 0, policy), [](Pass& its) { its.lose_samples(5); });
  } else if (name == "slot: a fix every 3 s, then every 1 s") {
    Pass pass(1, 0, policy);
    pass.lose_two_of_three_fixes(45);
    pass.go_on(43);
    pass.count(name);
  } else if (name == "slot: spread over 1000 samples") {
    Pass(3, 0, policy_with(1000)).count(name);
  } else if (name == "slot: the star tracker jumps") {
    Pass pass(3, 0, policy);
    pass.turn_the_star_tracker(0.02);
    pass.go_on(3 * kReopenAfter - 9);
    pass.count(name);
  } else if (name == "not spread: a fix every 3 s") {
    Pass(3, 0, policy_with(0)).count(name);
  } else if (name == "not spread: no star tracker") {
    Pass pass(3, 0, policy_with(0));
    pass.lose_the_star_tracker();
    pass.go_on(90);
    pass.count(name);
  } else if (name == "guarded slot: a fix every 3 s") {
    Pass pass(3, 0, policy);
    const auto guarded = std::make_unique<trihedron::Guarded<PairApplication>>(*pass.application);
    pass.count_with(name, [&](auto&& feed) { guarded->use(feed); });
  } else if (name == "others") {
    count_others(*Pass(3, 0, policy).application);
  } else {
    return 2;
  }
  return 0;
}
