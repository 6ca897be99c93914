// trihedron.h as a C program sees it, and that it is the application itself.

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "application_flight.hpp"
#include "trihedron.h"

namespace trihedron {
namespace {

/// ObjectMemory as the constants of the header ask for it, full of garbage.
template <std::size_t kSize>
struct alignas(TRIHEDRON_ALIGNMENT) ObjectMemory {
  std::byte bytes[kSize];
  ObjectMemory() { std::memset(bytes, 0xA5, kSize); }
};
using OfTwo = ObjectMemory<TRIHEDRON_SIZE_OF_2_GYROS>;

trihedron_gyro_sample record_of(const GyroSample& sample) {
  trihedron_gyro_sample record{};
  record.time_ns = sample.t.time_since_epoch().count();
  for (int k = 0; k < TRIHEDRON_MAX_GYROS; ++k) {
    Eigen::Map<Eigen::Vector3d>(record.h_b[k]) = sample.h_b[k];
  }
  return record;
}
trihedron_star_fix record_of(const StarFix& fix) {
  trihedron_star_fix record{};
  record.time_ns = fix.t.time_since_epoch().count();
  Eigen::Map<Eigen::Vector4d>(record.q_in_c) = fix.q_in_c.coeffs();
  return record;
}

/// What test::fly() drives.
struct ByC {
  trihedron_application* its;

  StepReport on_gyro(const GyroSample& sample) const {
    const auto record = record_of(sample);
    StepReport report;
    report.sample = static_cast<SampleStatus>(trihedron_on_gyro(its, &record));
    return report;
  }
  StepReport on_fix(const StarFix& fix) const {
    const auto record = record_of(fix);
    StepReport report;
    report.fix.status = static_cast<FixStatus>(trihedron_on_fix(its, &record));
    return report;
  }
};

TEST(CInterface, SaysWhatItIs) {
  EXPECT_EQ(trihedron_interface_version(), TRIHEDRON_INTERFACE_VERSION);
  EXPECT_EQ(trihedron_tables_version(), TRIHEDRON_TABLES_VERSION);
  EXPECT_EQ(TRIHEDRON_ALIGNMENT % trihedron_alignment(), 0U);
  EXPECT_GT(trihedron_size(2), 20000U);
  EXPECT_LE(trihedron_size(2), TRIHEDRON_SIZE_OF_2_GYROS);
  EXPECT_LE(trihedron_size(3), TRIHEDRON_SIZE_OF_3_GYROS);
  EXPECT_LE(trihedron_snapshots_size(2), TRIHEDRON_SNAPSHOTS_SIZE_OF_2_GYROS);
  EXPECT_LE(trihedron_snapshots_size(3), TRIHEDRON_SNAPSHOTS_SIZE_OF_3_GYROS);
  for (const std::uint32_t gyros : {0U, 1U, 4U}) {
    EXPECT_EQ(trihedron_size(gyros), 0U);
    EXPECT_EQ(trihedron_snapshots_size(gyros), 0U);
  }
}

TEST(CInterface, RefusesMemoryThatWillNotDo) {
  OfTwo memory;
  EXPECT_EQ(trihedron_create(nullptr, sizeof memory, 2), nullptr);
  EXPECT_EQ(trihedron_create(memory.bytes, trihedron_size(2) - 1, 2), nullptr);
  EXPECT_EQ(trihedron_create(memory.bytes, sizeof memory, 3), nullptr);
  EXPECT_EQ(trihedron_create(memory.bytes, sizeof memory, 4), nullptr);
  EXPECT_EQ(trihedron_create(memory.bytes + 4, sizeof memory - 4, 2), nullptr);
  EXPECT_NE(trihedron_create(memory.bytes, trihedron_size(2), 2), nullptr);
}

TEST(CInterface, IsTheApplicationBitForBit) {
  const test::Flight flight({.duration_s = 1500});
  const Parameters parameters = test::nominal_parameters();
  const auto application = test::started<PairApplication>(parameters);
  OfTwo memory;
  trihedron_application* its = trihedron_create(memory.bytes, sizeof memory, 2);
  AttitudeRecord attitude{};
  EXPECT_EQ(trihedron_get_attitude(its, &attitude), 0U);
  EXPECT_EQ(trihedron_load_parameters(its, &parameters), TRIHEDRON_ANSWER_ACCEPTED);
  EXPECT_EQ(trihedron_command(its, TRIHEDRON_COMMAND_START, 0), TRIHEDRON_ANSWER_ACCEPTED);
  std::vector<SampleStatus> samples[2];
  std::vector<FixStatus> fixes[2];
  const auto note = [&](std::size_t which) {
    return [&, which](const StepReport& report) {
      samples[which].push_back(report.sample);
      fixes[which].push_back(report.sample == SampleStatus::kNone ? report.fix.status : FixStatus::kNone);
    };
  };
  ByC by_c{its};
  test::fly(flight, by_c, note(0));
  test::fly(flight, *application, note(1));
  EXPECT_EQ(samples[0], samples[1]);
  EXPECT_EQ(fixes[0], fixes[1]);
  Housekeeping record{};
  trihedron_get_housekeeping(its, &record);
  const Housekeeping expected = application->housekeeping();
  EXPECT_EQ(record.mode, TRIHEDRON_MODE_NAVIGATING);
  EXPECT_EQ(std::memcmp(&record, &expected, sizeof record), 0);
  EXPECT_EQ(trihedron_get_attitude(its, &attitude), 1U);
  EXPECT_EQ(attitude.time_ns, flight.samples.back().t.time_since_epoch().count());
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(std::sqrt(attitude.covariance_rad2[i][i]), record.sigma_rad[i]);
  }
}

TEST(CInterface, GivesTheCalibrationAsItIsLoaded) {
  const test::Flight flight({.duration_s = 600});
  Parameters parameters = test::nominal_parameters();
  OfTwo memory;
  ByC by_c{trihedron_create(memory.bytes, sizeof memory, 2)};
  CalibrationRecord found{};
  EXPECT_EQ(trihedron_get_calibration(by_c.its, &found), 0U);
  EXPECT_EQ(trihedron_load_parameters(by_c.its, &parameters), TRIHEDRON_ANSWER_ACCEPTED);
  EXPECT_EQ(trihedron_command(by_c.its, TRIHEDRON_COMMAND_START, 0), TRIHEDRON_ANSWER_ACCEPTED);
  EXPECT_EQ(trihedron_get_calibration(by_c.its, &found), 0U);
  test::fly(flight, by_c);
  ASSERT_EQ(trihedron_get_calibration(by_c.its, &found), 1U);
  EXPECT_EQ(found.gyros, 2U);
  EXPECT_EQ(found.version, TRIHEDRON_TABLES_VERSION);
  Housekeeping housekeeping{};
  trihedron_get_housekeeping(by_c.its, &housekeeping);
  // It may rest on the next one already, whose work goes on.
  EXPECT_GE(found.time_ns, housekeeping.last_fix_ns);
  EXPECT_LE(found.time_ns, housekeeping.last_fix_ns + 3'000'000'000);

  test::PairGyros estimates;
  for (int k = 0; k < 2; ++k) {
    estimates[k].drift_rad_s = Eigen::Map<const Eigen::Matrix<double, 7, 1>>(found.drift_rad_s[k]);
    estimates[k].C_c_b = Rot<C, C>::exp(Vec<C>::assume(Eigen::Vector3d(found.alignment_rad[k]))).raw();
  }
  Eigen::MatrixXd covariance(20, 20);
  for (int row = 0; row < 20; ++row) {
    for (int column = 0; column <= row; ++column) {
      covariance(row, column) = covariance(column, row) = found.covariance[test::covariance_index(row, column)];
    }
  }
  const double nees = test::normalised_square(test::parameter_errors(flight.truth, estimates), covariance);
  EXPECT_GT(nees, 5);  // χ² of 20, once in a thousand times each
  EXPECT_LT(nees, 45);

  // It is loaded again as it is.
  std::memcpy(parameters.drift_rad_s, found.drift_rad_s, sizeof found.drift_rad_s);
  std::memcpy(parameters.alignment_rad, found.alignment_rad, sizeof found.alignment_rad);
  std::memcpy(parameters.covariance, found.covariance, sizeof found.covariance);
  EXPECT_EQ(trihedron_command(by_c.its, TRIHEDRON_COMMAND_RESET, 0), TRIHEDRON_ANSWER_ACCEPTED);
  EXPECT_EQ(trihedron_load_parameters(by_c.its, &parameters), TRIHEDRON_ANSWER_ACCEPTED);
}

TEST(CInterface, GivesTheCalibrationOfOneMomentWhileAFixIsDealtWith) {
  const test::Flight flight({.duration_s = 60});
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  CalibrationRecord last{.time_ns = -1};
  int given = 0;
  int taken_in = 0;
  test::fly(flight, *application, [&](const StepReport& report) {
    CalibrationRecord now{};
    if (!application->get(now)) {
      return;
    }
    ++given;
    EXPECT_LE(now.time_ns, report.t.time_since_epoch().count());
    const bool has_moved = std::memcmp(now.drift_rad_s, last.drift_rad_s, sizeof now.drift_rad_s) != 0;
    const double variance = now.covariance[test::covariance_index(8, 8)];  // of the alignment about c y
    const double before = last.covariance[test::covariance_index(8, 8)];
    if (now.time_ns == last.time_ns) {
      EXPECT_FALSE(has_moved) << now.time_ns;
      EXPECT_NEAR(variance, before, 1e-9 * before) << now.time_ns;
    } else if (++taken_in > 1) {  // the first starts the filter at the prior
      EXPECT_TRUE(has_moved) << now.time_ns;
      EXPECT_LT(variance, before) << now.time_ns;
    }
    last = now;
  });
  EXPECT_GT(given, 400);
  EXPECT_GE(taken_in, 18);
}

TEST(CInterface, TimeOfTheCalibrationIsThatOfAFixThatWasUsed) {
  test::Flight flight({.duration_s = 400});
  flight.fixes[20].q_in_c = flight.fixes[20].q_in_c * Eigen::Quaterniond(test::turn(0.05, 0, 0));  // an outlier
  const std::int64_t wrong_ns = flight.fixes[20].t.time_since_epoch().count();
  flight.fixes.resize(40);  // from then on the angles alone
  const std::int64_t last_ns = flight.fixes.back().t.time_since_epoch().count();
  const auto application = test::started<PairApplication>(test::nominal_parameters());
  int by_angles = 0;
  test::fly(flight, *application, [&](const StepReport& report) {
    by_angles += report.angles.status == FixStatus::kUsed ? 1 : 0;
    CalibrationRecord now{};
    if (application->get(now)) {
      EXPECT_NE(now.time_ns, wrong_ns);
      EXPECT_LE(now.time_ns, last_ns);
      EXPECT_TRUE(by_angles == 0 || now.time_ns == last_ns);
    }
  });
  EXPECT_GT(by_angles, 2);
}

TEST(CInterface, OfThreeGyrosIsTheirApplicationBitForBit) {
  const test::Flight flight({.duration_s = 120});
  const auto samples = test::with_third_gyro(flight, Eigen::Vector3d(0.1, -0.8, 0.6).normalized(), 1);
  const Parameters parameters = test::nominal_parameters(3);
  const auto application = test::started<TrioApplication>(parameters);
  ObjectMemory<TRIHEDRON_SIZE_OF_3_GYROS> memory;
  ByC by_c{trihedron_create(memory.bytes, sizeof memory, 3)};
  EXPECT_EQ(trihedron_load_parameters(by_c.its, &parameters), TRIHEDRON_ANSWER_ACCEPTED);
  EXPECT_EQ(trihedron_command(by_c.its, TRIHEDRON_COMMAND_START, 0), TRIHEDRON_ANSWER_ACCEPTED);
  test::fly(samples, flight.fixes, by_c);
  test::fly(samples, flight.fixes, *application);
  const Housekeeping expected = application->housekeeping();
  AttitudeRecord attitude{};
  EXPECT_EQ(trihedron_get_attitude(by_c.its, &attitude), 1U);
  EXPECT_EQ(std::memcmp(attitude.q_in_c, expected.q_in_c, sizeof attitude.q_in_c), 0);

  std::vector<std::byte> slots(trihedron_snapshots_size(3));
  EXPECT_EQ(trihedron_save(by_c.its, slots.data(), slots.size()), 1U);
  ObjectMemory<TRIHEDRON_SIZE_OF_3_GYROS> other;
  ByC again{trihedron_create(other.bytes, sizeof other, 3)};
  EXPECT_EQ(trihedron_restore(again.its, slots.data(), slots.size(), nullptr), 1U);
  for (const ByC& its : {by_c, again}) {
    Housekeeping record{};
    trihedron_get_housekeeping(its.its, &record);
    EXPECT_EQ(std::memcmp(&record, &expected, sizeof record), 0);
  }
}

TEST(CInterface, RefusesWhatItDoesNotKnow) {
  OfTwo memory;
  trihedron_application* its = trihedron_create(memory.bytes, sizeof memory, 2);
  for (const std::uint32_t command : {7U, 255U, 256U, 0xFFFFFFFFU}) {
    EXPECT_EQ(trihedron_command(its, command, 0), TRIHEDRON_ANSWER_UNKNOWN_COMMAND);
  }
  EXPECT_EQ(trihedron_command(its, TRIHEDRON_COMMAND_START, 0), TRIHEDRON_ANSWER_NO_PARAMETERS);
  Parameters parameters = test::nominal_parameters();
  parameters.version = 99;
  EXPECT_EQ(trihedron_load_parameters(its, &parameters), TRIHEDRON_ANSWER_WRONG_VERSION);
  Housekeeping record{};
  trihedron_get_housekeeping(its, &record);
  EXPECT_EQ(record.commands_refused, 6U);
}

TEST(CInterface, HasDefaultsThatAreAccepted) {
  ObjectMemory<TRIHEDRON_SIZE_OF_3_GYROS> memory;
  for (const std::uint32_t gyros : {2U, 3U}) {
    Parameters parameters;
    trihedron_default_parameters(gyros, &parameters);
    trihedron_application* its = trihedron_create(memory.bytes, sizeof memory, gyros);
    EXPECT_EQ(trihedron_load_parameters(its, &parameters), TRIHEDRON_ANSWER_ACCEPTED);
    EXPECT_EQ(parameters.covariance[test::covariance_index(13, 13)], 4e-12);
    EXPECT_EQ(parameters.covariance[test::covariance_index(18, 18)], 8.7e-3 * 8.7e-3);
    EXPECT_EQ(parameters.covariance[test::covariance_index(18, 17)], 0);
  }
}

TEST(CInterface, SavesAndRestores) {
  const test::Flight flight({.duration_s = 60});
  const Parameters parameters = test::nominal_parameters();
  OfTwo memory;
  trihedron_application* its = trihedron_create(memory.bytes, sizeof memory, 2);
  trihedron_load_parameters(its, &parameters);
  trihedron_command(its, TRIHEDRON_COMMAND_START, 0);
  ByC by_c{its};
  test::fly_from(flight, 0, 30, by_c);
  std::vector<std::byte> slots(trihedron_snapshots_size(2) + 1);
  void* unaligned = slots.data() + 1;
  const std::size_t size = slots.size() - 1;
  EXPECT_EQ(trihedron_save(its, unaligned, size - 1), 0U);
  EXPECT_EQ(trihedron_save(its, unaligned, size), 1U);
  test::fly_from(flight, 30, 1e9, by_c);
  Housekeeping whole{};
  trihedron_get_housekeeping(its, &whole);

  OfTwo other;
  ByC again{trihedron_create(other.bytes, sizeof other, 2)};
  std::uint32_t answers[2];
  EXPECT_EQ(trihedron_restore(again.its, unaligned, size - 1, answers), 0U);
  EXPECT_EQ(answers[0], TRIHEDRON_SNAPSHOT_TOO_SMALL);
  EXPECT_EQ(trihedron_restore(again.its, unaligned, size, nullptr), 1U);
  EXPECT_EQ(trihedron_restore(again.its, unaligned, size, answers), 1U);
  EXPECT_EQ(answers[0], TRIHEDRON_SNAPSHOT_RESTORED);
  EXPECT_EQ(answers[1], TRIHEDRON_SNAPSHOT_FOREIGN);
  test::fly_from(flight, 30, 1e9, again);
  Housekeeping restored{};
  trihedron_get_housekeeping(again.its, &restored);
  EXPECT_EQ(std::memcmp(&whole, &restored, sizeof whole), 0);
}

}  // namespace
}  // namespace trihedron
