// fly FEED RESULT: flies the on-board object through a feed and writes what came out, on any target. The desktop
// compares the results of targets; see fly.py, which also names the columns of a record.

#include <algorithm>
#include <cstdint>

#include "feed.hpp"
#include "flown.hpp"
#include "probe.hpp"
#include "word_file.hpp"

namespace {

using namespace trihedron;
using namespace trihedron::targets;

constexpr std::uint64_t kResultFormat = 0x31'544c'5553'4552;  // "RESULT1", least significant byte first

Flown on_board;
GivenToFlight given;

enum ExitStatus { kFlown = 0, kWrongUsage = 2, kNoFeed = 3, kNoResult = 4 };

std::int64_t number_of(Time t) { return t.time_since_epoch().count(); }

/// What one call cost, in instructions.
template <class Call>
std::uint32_t cost_of(Call&& call) {
  const std::uint32_t before = instructions();
  call();
  return instructions_between(before, instructions());
}

void put_attitude(const std::optional<AttitudeSolution>& solution, WordWriter& result) {
  const AttitudeSolution its = solution.value_or(AttitudeSolution{});
  for (int i = 0; i < 9; ++i) {
    result.put(solution ? its.C_in_c.raw()(i) : 0.0);
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) {
      result.put(solution ? its.covariance_rad2(row, column) : 0.0);
    }
  }
}

/// One record: kind of event, time, status of sample and of fix, NIS, attitude now, its covariance, and what step and
/// attitude cost.
void put_record(EventKind kind, const StepReport& report, std::uint32_t step_cost, WordWriter& result) {
  std::optional<AttitudeSolution> attitude;
  const std::uint32_t attitude_cost = cost_of([&] {
    if (on_board.navigator().started()) {
      if (const auto solution = on_board.navigation_attitude()) {
        attitude = solution.value();
      }
    }
  });
  result.put(static_cast<std::uint64_t>(kind));
  result.put(number_of(report.t));
  result.put(static_cast<std::uint64_t>(report.sample));
  result.put(static_cast<std::uint64_t>(report.fix.status));
  result.put(report.fix.nis);
  put_attitude(attitude, result);
  result.put(std::uint64_t{step_cost});
  result.put(std::uint64_t{attitude_cost});
}

/// The calibration at the end: gyros, and the root of the information.
void put_calibration(WordWriter& result) {
  const auto& estimator = on_board.estimator();
  for (const auto& gyro : estimator.gyros()) {
    for (int i = 0; i < 3; ++i) {
      result.put(gyro.h_in(i));
    }
    for (int i = 0; i < gyro.drift_rad_s.size(); ++i) {
      result.put(gyro.drift_rad_s(i));
    }
    for (int i = 0; i < 9; ++i) {
      result.put(gyro.C_c_b(i));
    }
  }
  const ConstRowsView root = estimator.information().root();
  for (int i = 0; i < root.rows; ++i) {
    for (int j = 0; j < root.columns; ++j) {
      result.put(j < i ? 0.0 : root(i, j));
    }
  }
}

/// Feeds the events; false where the feed broke off. The stack is counted from here: what lies in this frame, above all
/// the report of a step, is the caller's.
bool fly(WordReader& feed, WordWriter& result) {
  paint_stack();
  FromFeed next(feed);
  for (;;) {
    Event event;
    exchange(next, event);
    if (!feed.ok() || event.kind == EventKind::kEnd) {
      return feed.ok();
    }
    StepReport report;
    const std::uint32_t cost = cost_of([&] {
      report = event.kind == EventKind::kGyro ? on_board.on_gyro(event.sample()) : on_board.on_fix(event.fix());
    });
    put_record(event.kind, report, cost, result);
    while (report.more_due) {
      const std::uint32_t further_cost = cost_of([&] { report = on_board.carry_on(); });
      put_record(EventKind::kFix, report, further_cost, result);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    return kWrongUsage;
  }
  static WordReader feed(argv[1]);
  static WordWriter result(argv[2]);
  FromFeed next(feed);
  std::uint64_t format = 0;
  next(format);
  exchange(next, given);
  const int parameters = given.setup.layout.parameters();
  if (!feed.ok() || format != kFeedFormat || parameters > kMostParameters ||
      on_board.set_up(given.setup, given.prior, given.covariance.topLeftCorner(parameters, parameters), given.policy)) {
    return kNoFeed;
  }
  result.put(kResultFormat);
  start_counting();
  const bool whole = fly(feed, result);
  const std::size_t stack_bytes = stack_used();
  result.put(static_cast<std::uint64_t>(EventKind::kEnd));
  put_calibration(result);
  result.put(std::uint64_t{measures()});
  result.put(std::uint64_t{stack_bytes});
  result.put(std::uint64_t{sizeof(on_board)});
  result.put(std::uint64_t{sizeof(StepReport)});
  if (!whole) {
    return kNoFeed;
  }
  return result.close() ? kFlown : kNoResult;
}
