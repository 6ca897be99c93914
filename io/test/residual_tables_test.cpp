#include <gmock/gmock.h>

#include <chrono>
#include <string>
#include <vector>

#include "trihedron/io/residuals.hpp"

namespace trihedron::io {
namespace {

using std::chrono::seconds;
using testing::ElementsAre;
using testing::IsSupersetOf;

/// Two fixes, of which the second is rejected, and two rows of estimates.
CalibrationRun run_of(std::size_t gyros) {
  CalibrationRun run;
  run.calibration.gyros.resize(gyros);
  run.calibration.states = {parameter_named("gyro1.k0").value(), parameter_named("gyro2.align_z").value()};
  for (int i = 0; i < 2; ++i) {
    FixRecord& fix = run.fixes.emplace_back();
    fix.t = Time(seconds(3 * i));
    fix.status = i == 0 ? FixStatus::kUsed : FixStatus::kRejectedByGate;
    fix.nis = 4.0 + i;
    for (std::size_t component = 0; component < 2 * gyros; ++component) {
      fix.innovation.push_back(0.1 * static_cast<double>(component) + i);
      fix.innovation_sigma.push_back(10);
    }
    run.parameters.t.push_back(fix.t);
    run.parameters.value.push_back({1.0 + i, -1.0 - i});
    run.parameters.sigma.push_back({0.5, 0.25});
  }
  run.angle_t = {Time(seconds(1))};
  run.angle_residual_min = {-1e-5};
  run.angle_residual_max = {2e-5};
  return run;
}

std::vector<std::string> names_of(const Table& table) {
  std::vector<std::string> names;
  for (const Column& column : table.columns) {
    names.push_back(column.name);
  }
  return names;
}

TEST(ResidualTables, HoldTheInnovationsByGyroAndComponent) {
  const std::vector<Table> tables = residual_tables(run_of(2));
  ASSERT_EQ(tables.size(), 3U);
  const Table& fixes = tables[0];
  EXPECT_EQ(fixes.group, "fixes");
  EXPECT_THAT(fixes.t, ElementsAre(Time(seconds(0)), Time(seconds(3))));
  // Of a pair as the paper numbers its quasi-inertial axes.
  EXPECT_THAT(names_of(fixes), ElementsAre("innovation_gyro1_1", "innovation_gyro1_1_sigma", "innovation_gyro1_3",
                                           "innovation_gyro1_3_sigma", "innovation_gyro2_1", "innovation_gyro2_1_sigma",
                                           "innovation_gyro2_2", "innovation_gyro2_2_sigma", "nis", "used"));
  EXPECT_THAT(fixes.columns[4].values, ElementsAre(0.2, 1.2));
  EXPECT_THAT(fixes.columns[5].values, ElementsAre(10, 10));
  EXPECT_THAT(fixes.columns[8].values, ElementsAre(4, 5));
  EXPECT_THAT(fixes.columns[9].values, ElementsAre(1, 0));
}

TEST(ResidualTables, OfThreeGyrosCountTheComponentsOfEach) {
  EXPECT_THAT(names_of(residual_tables(run_of(3))[0]),
              IsSupersetOf({"innovation_gyro1_1", "innovation_gyro1_2", "innovation_gyro3_2_sigma"}));
}

TEST(ResidualTables, HoldTheEstimatesAlongThePass) {
  const Table parameters = residual_tables(run_of(2))[1];
  EXPECT_EQ(parameters.group, "parameters");
  EXPECT_THAT(names_of(parameters), ElementsAre("gyro1_k0", "gyro1_k0_sigma", "gyro2_align_z", "gyro2_align_z_sigma"));
  EXPECT_EQ(parameters.columns[0].units, "rad s-1");
  EXPECT_EQ(parameters.columns[2].units, "rad");
  EXPECT_THAT(parameters.columns[2].values, ElementsAre(-1, -2));
  EXPECT_THAT(parameters.columns[3].values, ElementsAre(0.25, 0.25));
}

TEST(ResidualTables, HoldTheResidualOfTheAngle) {
  const Table angle = residual_tables(run_of(2))[2];
  EXPECT_EQ(angle.group, "angle");
  EXPECT_THAT(angle.t, ElementsAre(Time(seconds(1))));
  EXPECT_THAT(angle.columns[0].values, ElementsAre(-1e-5));
  EXPECT_THAT(angle.columns[1].values, ElementsAre(2e-5));
}

}  // namespace
}  // namespace trihedron::io
