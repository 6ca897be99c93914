// Runs one part of nine hours, or a number of hours of the on-board step, once: for callgrind, which counts the
// instructions between the marks.

#include <valgrind/callgrind.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "parts.hpp"

int main(int argc, char** argv) {
  using namespace trihedron;
  const std::string name = argc == 2 ? argv[1] : "";
  bench::Run run;
  if (name.starts_with("hours/")) {
    const double hours = std::atof(name.c_str() + 6);
    run = bench::on_board(std::make_shared<const bench::Events>(bench::events_of(bench::scenario_of(hours))), true);
  } else {
    const auto& parts = bench::parts();
    const auto part = std::ranges::find(parts, name, &bench::Part::name);
    if (part == parts.end()) {
      std::fputs("usage: trihedron_count_parts PART | hours/NUMBER; the parts:\n", stderr);
      for (const bench::Part& its : parts) {
        std::fprintf(stderr, "  %s\n", its.name.c_str());
      }
      return 2;
    }
    run = part->prepare();
  }
  CALLGRIND_START_INSTRUMENTATION;
  CALLGRIND_ZERO_STATS;
  run();
  CALLGRIND_DUMP_STATS_AT("part");
  CALLGRIND_STOP_INSTRUMENTATION;
}
