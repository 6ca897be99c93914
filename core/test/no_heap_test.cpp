// Linked with counting malloc and operator new: after its construction, the cycle allocates nothing.

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

#include "flight.hpp"
#include "trihedron/core/cycles.hpp"
#include "trihedron/core/invariant_estimator.hpp"

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

/// Every way through a step: outliers up to reopening, bad samples, bad fixes.
template <class Estimator>
void expect_no_allocations(const typename Estimator::Setup& setup) {
  test::Flight flight({.duration_s = 600, .fix_offset_s = 0.05});
  for (std::size_t i = 100; i < 125; ++i) {
    flight.fixes[i].q_in_c =
        flight.fixes[i].q_in_c * Eigen::Quaterniond(Eigen::AngleAxisd(0.001, Eigen::Vector3d::UnitX()));
  }
  flight.samples[77].h_b[0].setZero();
  flight.fixes[33].q_in_c.coeffs().setZero();
  auto cycle = std::make_unique<Cycle<Estimator>>(
      Cycle<Estimator>::create(setup, {.interval = std::chrono::minutes(1)}).value());
  const long before = allocations;
  double used = 0;
  test::fly(flight, *cycle, [&](const auto& report) { used += report.fix.used(); });
  const auto solution = cycle->navigation_attitude();
  EXPECT_EQ(allocations, before);
  EXPECT_TRUE(solution.ok());
  EXPECT_GT(used, 150);
}

TEST(Cycle, OfThePaperAllocatesNothingInAnyStep) { expect_no_allocations<PaperEstimator<Esg7>>(test::nominal_setup()); }

TEST(Cycle, OfTheInvariantErrorAllocatesNothingInAnyStep) {
  using Estimator = InvariantEstimator<Esg7, 2, kAllFurtherStates>;
  Estimator::Setup setup;
  static_cast<CalibrationSetup<Esg7, 2>&>(setup) = test::nominal_setup();
  setup.wandering_sigma_rad_s = 1e-8;
  expect_no_allocations<Estimator>(setup);
}

}  // namespace
}  // namespace trihedron
