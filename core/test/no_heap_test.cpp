// Linked with counting malloc and operator new: the on-board step allocates nothing, from its set-up on.

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

#include "application_flight.hpp"
#include "flight.hpp"
#include "trihedron/core/snapshot.hpp"

namespace {

long allocations = 0;

}  // namespace

// NOLINTBEGIN: these are the names that the linker's --wrap=malloc asks for.
extern "C" {
void* __real_malloc(std::size_t);
void* __wrap_malloc(std::size_t size) {
  ++allocations;
  return __real_malloc(size);
}
}
// NOLINTEND

void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = __real_malloc(size)) {
    return p;
  }
  throw std::bad_alloc();
}
// Both ends are replaced here and go to malloc and free; the compiler sees only one of them.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace trihedron {
namespace {

TEST(Allocations, AreCounted) {
  const long before = allocations;
  const auto p = std::make_unique<int>(1);
  EXPECT_EQ(allocations, before + 1);
  void* volatile q = std::malloc(1);  // volatile: or the compiler does without
  EXPECT_EQ(allocations, before + 2);
  std::free(q);
}

/// Every way through a step: outliers up to reopening, bad samples, bad fixes, a gyro that stands still, angles without
/// fixes, a clock that is set back.
template <class Estimator>
void expect_no_allocations(const test::Given<Estimator>& given) {
  test::Flight flight({.duration_s = 600, .fix_offset_s = 0.05});
  const int gyros = given.setup.layout.gyros;
  if (gyros > 2) {
    flight.samples = test::with_third_gyro(flight, Eigen::Vector3d(0.1, -0.8, 0.6).normalized(), 1);
  }
  for (std::size_t i = 0; i < flight.samples.size() && gyros > 3; ++i) {
    flight.samples[i].h_b[3] = -(flight.samples[i].h_b[1] + flight.samples[i].h_b[2]).normalized();
  }
  for (std::size_t i = 100; i < 125; ++i) {
    flight.fixes[i].q_in_c =
        flight.fixes[i].q_in_c * Eigen::Quaterniond(Eigen::AngleAxisd(0.001, Eigen::Vector3d::UnitX()));
  }
  flight.samples[77].h_b[0].setZero();
  flight.fixes[33].q_in_c.coeffs().setZero();
  for (std::size_t i = 3900; i < 3930; ++i) {
    flight.samples[i].h_b[gyros - 1] = flight.samples[3900].h_b[gyros - 1];
  }
  for (std::size_t i = 4700; i < flight.samples.size(); ++i) {
    flight.samples[i].t -= std::chrono::seconds(100);
  }
  std::erase_if(flight.fixes, [](const StarFix& fix) {
    return fix.t > Time(std::chrono::seconds(200)) && fix.t < Time(std::chrono::seconds(290));
  });
  const int star_trackers = given.setup.layout.star_trackers;
  for (std::size_t i = 0; i < flight.fixes.size(); ++i) {
    flight.fixes[i].head = static_cast<int>(i) % star_trackers;
  }
  const auto on_board = std::make_unique<OnBoard<Estimator>>();
  double used = 0;
  double angles = 0;
  bool reopened = false;
  bool set_back = false;
  const test::OnReport note = [&](const StepReport& report) {
    used += report.fix.used();
    reopened = reopened || report.fix.status == FixStatus::kUsedAfterReopening;
    angles += report.angles.status != FixStatus::kNone;
    set_back = set_back || report.sample == SampleStatus::kUsedAfterClockSetBack;
  };
  const long before = allocations;
  EXPECT_EQ(on_board->set_up(given.setup, given.prior, given.covariance, {.interval = std::chrono::minutes(1)}),
            std::nullopt);
  test::fly(flight, *on_board, note);
  static_cast<void>(on_board->carry_on());
  test::flush(*on_board, note);
  const auto solution = on_board->navigation_attitude();
  EXPECT_EQ(allocations, before);
  EXPECT_TRUE(solution.ok());
  EXPECT_GT(used, 110);  // 119 with every state
  EXPECT_TRUE(reopened);
  EXPECT_TRUE(set_back);
  EXPECT_EQ(angles > 0, Estimator::kUsesAngles);
}

TEST(Application, AllocatesNothing) {
  const test::Flight flight({.duration_s = 1500});
  const auto memory = std::make_unique<std::array<std::byte, SnapshotStore<PairApplication>::kSize>>();
  const Parameters table = test::nominal_parameters();
  const auto application = std::make_unique<PairApplication>();
  const long before = allocations;
  EXPECT_EQ(application->load(table), Answer::kAccepted);
  EXPECT_EQ(application->command(Command::kStart), Answer::kAccepted);
  test::fly(flight, *application);
  EXPECT_EQ(application->command(Command::kSelectGyros, 0b11), Answer::kAccepted);
  EXPECT_EQ(application->command(Command::kHoldCalibration), Answer::kAccepted);
  const Housekeeping record = application->housekeeping();
  EXPECT_EQ(SnapshotStore<PairApplication>::save(*application, *memory), 1U);
  EXPECT_EQ(SnapshotStore<PairApplication>::restore(*memory, *application).sequence, 1U);
  EXPECT_EQ(application->command(Command::kReset), Answer::kAccepted);
  EXPECT_EQ(allocations, before);
  EXPECT_EQ(record.mode, TRIHEDRON_MODE_NAVIGATING);
}

TEST(OnBoard, OfThePaperAllocatesNothing) { expect_no_allocations<PaperEstimator>(test::PaperGiven()); }

TEST(OnBoard, OfAPairAllocatesNothing) { expect_no_allocations<test::PairEstimator>(test::PairGiven()); }

TEST(OnBoard, WithEverythingAllocatesNothing) {
  for (const Layout& layout : {Layout{.further = kAllFurtherStates, .star_trackers = 2}, kLargestLayout}) {
    test::FullGiven given(layout);
    given.setup.wandering_drift.sigma = 1e-8;
    expect_no_allocations<test::FullEstimator>(given);
  }
}

}  // namespace
}  // namespace trihedron
