// What each slot of the on-board application takes: run under callgrind by slots.py, which counts the instructions
// between two of these marks. A slot is a gyro sample and the fix at its time; fixes come every three seconds, a
// calibration is adopted, and the navigator is corrected at each fix. Slots, and then the same ones with the state
// guarded.

#include <valgrind/callgrind.h>

#include <cstddef>
#include <memory>
#include <string>

#include "application_flight.hpp"
#include "trihedron/core/guarded.hpp"
#include "trihedron/core/snapshot.hpp"

namespace {

using trihedron::PairApplication;

template <class F>
void counted(const std::string& name, F&& f) {
  CALLGRIND_START_INSTRUMENTATION;
  CALLGRIND_ZERO_STATS;
  f();
  CALLGRIND_DUMP_STATS_AT(name.c_str());
  CALLGRIND_STOP_INSTRUMENTATION;
}

}  // namespace

int main() {
  using trihedron::Guarded;
  constexpr std::size_t kFirst = 8 * 1350;
  constexpr std::size_t kLast = kFirst + 8 * 30;
  const trihedron::test::Flight flight({.duration_s = 1400});
  const auto application = trihedron::test::started<PairApplication>(trihedron::test::nominal_parameters());
  trihedron::test::fly_from(flight, 0, 1350, *application);
  const auto guarded = std::make_unique<Guarded<PairApplication>>(*application);
  const auto feed = [&](std::size_t i, PairApplication& its) {
    its.on_gyro(flight.samples[i]);
    if (i % 24 == 0) {
      its.on_fix(flight.fixes[i / 24]);
    }
  };
  for (std::size_t i = kFirst; i < kLast; ++i) {
    counted("slot", [&] { feed(i, *application); });
    counted("guarded slot", [&] { guarded->use([&](PairApplication& its) { feed(i, its); }); });
  }
  counted("guard: check", [&] { guarded->check(); });
  counted("guard: check, copy and CRC", [&] { guarded->use([](PairApplication&) {}); });
  const auto memory = std::make_unique<std::array<std::byte, trihedron::SnapshotStore<PairApplication>::kSize>>();
  counted("snapshot", [&] { trihedron::SnapshotStore<PairApplication>::save(*application, *memory); });
  counted("restoring",
          [&] { static_cast<void>(trihedron::SnapshotStore<PairApplication>::restore(*memory, *application)); });
  counted("housekeeping", [&] { static_cast<void>(application->housekeeping()); });
  return application->mode() == trihedron::Mode::kNavigating ? 0 : 1;
}
