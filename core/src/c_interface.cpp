// trihedron.h on Application. Records of C are those of C++; the rest is which of the two applications it is.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>

#include "trihedron.h"
#include "trihedron/core/application.hpp"
#include "trihedron/core/snapshot.hpp"

// The names are those of the interface in C. NOLINTBEGIN(readability-identifier-naming)

struct trihedron_application {
  std::uint32_t gyros = 0;
};

namespace trihedron {
namespace {

constexpr std::uint32_t kOfPair = 2;
constexpr std::uint32_t kOfTrio = 3;

template <class Application>
struct Object : trihedron_application {
  Application application;
};
/// Who flies two gyros may build core without the application of three.
constexpr bool kHasTrio = TRIHEDRON_HAS_TRIO != 0;
using PairObject = Object<PairApplication>;
using TrioObject = std::conditional_t<kHasTrio, Object<TrioApplication>, PairObject>;
static_assert(sizeof(PairObject) <= TRIHEDRON_SIZE_OF_2_GYROS && alignof(PairObject) <= TRIHEDRON_ALIGNMENT);
static_assert(sizeof(TrioObject) <= TRIHEDRON_SIZE_OF_3_GYROS && alignof(TrioObject) <= TRIHEDRON_ALIGNMENT);
static_assert(SnapshotStore<PairApplication>::kSize <= TRIHEDRON_SNAPSHOTS_SIZE_OF_2_GYROS);
static_assert(SnapshotStore<TrioApplication>::kSize <= TRIHEDRON_SNAPSHOTS_SIZE_OF_3_GYROS);

/// Calls f with the application that it is.
template <class F>
auto with(trihedron_application* its, F&& f) {
  return its->gyros == kOfPair ? f(static_cast<PairObject*>(its)->application)
                               : f(static_cast<TrioObject*>(its)->application);
}
template <class F>
auto with(const trihedron_application* its, F&& f) {
  return its->gyros == kOfPair ? f(static_cast<const PairObject*>(its)->application)
                               : f(static_cast<const TrioObject*>(its)->application);
}

template <class Object>
trihedron_application* create(void* memory, std::size_t size, std::uint32_t gyros) {
  void* aligned = memory;
  if (std::align(alignof(Object), sizeof(Object), aligned, size) != memory) {
    return nullptr;  // too small or not aligned
  }
  // Gaps between members are part of a snapshot too.
  std::fill_n(static_cast<std::byte*>(memory), sizeof(Object), std::byte{});
  auto* object = std::construct_at(static_cast<Object*>(memory));
  object->gyros = gyros;
  return object;
}

Time time_of(std::int64_t ns) { return Time(Duration(ns)); }

}  // namespace
}  // namespace trihedron

using trihedron::Command;
using trihedron::create;
using trihedron::GyroSample;
using trihedron::kCommands;
using trihedron::kHasTrio;
using trihedron::kOfPair;
using trihedron::kOfTrio;
using trihedron::Layout;
using trihedron::PairApplication;
using trihedron::PairObject;
using trihedron::SnapshotStore;
using trihedron::StarFix;
using trihedron::time_of;
using trihedron::TrioObject;
using trihedron::with;

extern "C" {

std::uint32_t trihedron_interface_version(void) { return TRIHEDRON_INTERFACE_VERSION; }
std::uint32_t trihedron_tables_version(void) { return TRIHEDRON_TABLES_VERSION; }

std::size_t trihedron_size(std::uint32_t gyros) {
  return gyros == kOfPair ? sizeof(PairObject) : kHasTrio && gyros == kOfTrio ? sizeof(TrioObject) : 0;
}
std::size_t trihedron_alignment(void) { return std::max(alignof(PairObject), alignof(TrioObject)); }
std::size_t trihedron_snapshots_size(std::uint32_t gyros) {
  return gyros == kOfPair               ? SnapshotStore<PairApplication>::kSize
         : kHasTrio && gyros == kOfTrio ? SnapshotStore<decltype(TrioObject::application)>::kSize
                                        : 0;
}

trihedron_application* trihedron_create(void* memory, std::size_t size, std::uint32_t gyros) {
  if (memory == nullptr) {
    return nullptr;
  }
  return gyros == kOfPair               ? create<PairObject>(memory, size, gyros)
         : kHasTrio && gyros == kOfTrio ? create<TrioObject>(memory, size, gyros)
                                        : nullptr;
}

void trihedron_default_parameters(std::uint32_t gyros, trihedron_parameters* parameters) {
  constexpr double kDriftSigma_rad_s = 2e-6;
  constexpr double kAlignmentSigma_rad = 8.7e-3;
  *parameters = TRIHEDRON_PARAMETERS_DEFAULT;
  parameters->gyros = gyros;
  const int of_one = Layout{}.parameters() / Layout{}.gyros;
  double* element = parameters->covariance;
  for (int row = 0; row < of_one * TRIHEDRON_MAX_GYROS; ++row) {
    element += row;
    const double sigma = row % of_one < Layout::kEq1 ? kDriftSigma_rad_s : kAlignmentSigma_rad;
    *element++ = sigma * sigma;
  }
}

std::uint32_t trihedron_load_parameters(trihedron_application* its, const trihedron_parameters* parameters) {
  return with(its, [&](auto& application) { return static_cast<std::uint32_t>(application.load(*parameters)); });
}

std::uint32_t trihedron_command(trihedron_application* its, std::uint32_t command, std::uint32_t argument) {
  const auto known = static_cast<Command>(std::min<std::uint32_t>(command, kCommands));
  return with(its, [&](auto& application) { return static_cast<std::uint32_t>(application.command(known, argument)); });
}

std::uint32_t trihedron_on_gyro(trihedron_application* its, const trihedron_gyro_sample* sample) {
  GyroSample given;
  given.t = time_of(sample->time_ns);
  for (int k = 0; k < TRIHEDRON_MAX_GYROS; ++k) {
    given.h_b[k] = Eigen::Vector3d(sample->h_b[k]);
  }
  return with(its, [&](auto& application) { return static_cast<std::uint32_t>(application.on_gyro(given).sample); });
}

std::uint32_t trihedron_on_fix(trihedron_application* its, const trihedron_star_fix* fix) {
  const StarFix given{time_of(fix->time_ns), Eigen::Quaterniond(fix->q_in_c)};
  return with(its, [&](auto& application) { return static_cast<std::uint32_t>(application.on_fix(given).fix.status); });
}

std::uint32_t trihedron_get_attitude(const trihedron_application* its, trihedron_attitude* attitude) {
  return with(its, [&](const auto& application) -> std::uint32_t {
    const auto solution = application.attitude();
    if (!solution) {
      return 0;
    }
    attitude->time_ns = application.on_board().t().time_since_epoch().count();
    const Eigen::Quaterniond q = solution->C_in_c.quaternion();
    Eigen::Map<Eigen::Vector4d>(attitude->q_in_c) = q.coeffs();
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(attitude->covariance_rad2[0]) = solution->covariance_rad2;
    return 1;
  });
}

std::uint32_t trihedron_get_calibration(const trihedron_application* its, trihedron_calibration* calibration) {
  return with(its, [&](const auto& application) -> std::uint32_t { return application.get(*calibration) ? 1 : 0; });
}

void trihedron_get_housekeeping(const trihedron_application* its, trihedron_housekeeping* housekeeping) {
  *housekeeping = with(its, [](const auto& application) { return application.housekeeping(); });
}

std::uint64_t trihedron_save(const trihedron_application* its, void* memory, std::size_t size) {
  return with(its, [&]<class Application>(const Application& application) {
    return SnapshotStore<Application>::save(application, std::span(static_cast<std::byte*>(memory), size));
  });
}

std::uint64_t trihedron_restore(trihedron_application* its, const void* memory, std::size_t size,
                                std::uint32_t slots[2]) {
  return with(its, [&]<class Application>(Application& application) {
    const auto restored =
        SnapshotStore<Application>::restore(std::span(static_cast<const std::byte*>(memory), size), application);
    for (std::size_t i = 0; slots != nullptr && i < restored.slots.size(); ++i) {
      slots[i] = static_cast<std::uint32_t>(restored.slots[i]);
    }
    return restored.sequence;
  });
}

}  // extern "C"
// NOLINTEND(readability-identifier-naming)
