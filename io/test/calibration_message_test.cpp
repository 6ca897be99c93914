#include "trihedron/io/calibration_message.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "fixtures.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"

namespace trihedron::io::acm_test {
namespace {

using testing::HasSubstr;
using testing::Not;

MessageDescription description() {
  MessageDescription d;
  d.created_utc = "2026-01-02T03:04:05";
  return d;
}

TEST(Acm, HoldsEachParameterAndItsSigma) {
  const Calibration calibration = sample_calibration();
  const std::string text = format_acm(calibration, {nullptr, nullptr, "c.nc"}, description(), MessageSyntax::kKvn);
  EXPECT_THAT(text, HasSubstr(fmt::format("EPOCH_TZERO = {}\n", format_epoch(calibration.epoch))));
  EXPECT_THAT(text, HasSubstr("ACM_DATA_ELEMENTS = AD, USER\n"));
  EXPECT_THAT(text, HasSubstr("USER_DEFINED_TRIHEDRON_COVARIANCE_FILE = c.nc\n"));
  EXPECT_THAT(text, Not(HasSubstr("ATT_START")));
  for (const ParameterId& state : calibration.states) {
    if (state.is_alignment()) {
      const std::string key = fmt::format("USER_DEFINED_TRIHEDRON_GYRO{}_ALIGN_{}", state.gyro() + 1,
                                          "XYZ"[static_cast<std::size_t>(state.component)]);
      EXPECT_THAT(text, HasSubstr(fmt::format("{}_RAD = {:.15e}\n", key, value_of(calibration, state))));
      EXPECT_THAT(text, HasSubstr(fmt::format("{}_SIGMA_RAD = {:.15e}\n", key, sigma_of(calibration, state))));
    }
  }
}

TEST(Acm, HoldsAttitudeAndDiagonalCovariance) {
  const Calibration calibration = sample_calibration();
  AttitudeMessage attitude;
  attitude.attitude.t = {calibration.epoch + std::chrono::milliseconds(1500),
                         calibration.epoch + std::chrono::seconds(3)};
  attitude.attitude.q_in_c = {Eigen::Quaterniond(0.8, 0.6, 0, 0), Eigen::Quaterniond(1, 0, 0, 0)};
  attitude.attitude.sigma_rad = {{1e-5, 2e-5, 3e-5}, {kNaN, 1e-5, 1e-5}};
  const std::string text = format_acm(calibration, {&attitude, nullptr, ""}, description(), MessageSyntax::kKvn);
  EXPECT_THAT(text, HasSubstr("ACM_DATA_ELEMENTS = ATT, COV, AD, USER\n"));
  EXPECT_THAT(text, HasSubstr("1.500 6.000000000000000e-01 0.000000000000000e+00 0.000000000000000e+00 "
                              "8.000000000000000e-01\n"));
  EXPECT_THAT(text, HasSubstr("1.500 3.282806e-07 1.313123e-06 2.954526e-06\n"));  // deg²
  EXPECT_THAT(text, Not(HasSubstr("nan")));
  EXPECT_THAT(format_acm(calibration, {&attitude, nullptr, ""}, description(), MessageSyntax::kXml),
              HasSubstr("<covLine>1.500 3.282806e-07"));
}

TEST(Acm, IsNotInTdb) {
  MessageDescription d = description();
  d.time_scale = TimeScale::kTdb;
  EXPECT_THROW(static_cast<void>(format_acm(sample_calibration(), {}, d, MessageSyntax::kKvn)), UsageError);
}

TEST(Acm, CovarianceThatCannotBeWrittenIsAFailureOfTheMachine) {
  const TemporaryDirectory directory;
  EXPECT_THROW(write_covariance(directory / "no" / "c.nc", sample_calibration()), MachineFailed);
  EXPECT_TRUE(directory.names().empty());
}

}  // namespace
}  // namespace trihedron::io::acm_test
