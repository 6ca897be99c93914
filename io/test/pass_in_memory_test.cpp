#include <gmock/gmock.h>

#include <cmath>

#include "fixtures.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::io {
namespace {

using testing::HasSubstr;

class PassInMemoryTest : public testing::Test {
 protected:
  PassInMemoryTest() { raw_.save_directory(directory_.path()); }

  [[nodiscard]] PassInMemory tables() const { return read_tables(directory_.path()); }
  static std::string refused(const PassInMemory& tables) {
    return refusal([&] { static_cast<void>(screened(tables)); });
  }

  TemporaryDirectory directory_;
  RawPass raw_ = clean_pass();
};

TEST_F(PassInMemoryTest, IsThePassOfItsDirectory) {
  const PassInMemory read = tables();
  EXPECT_EQ(read.gyros, 2);
  ASSERT_EQ(read.star_trackers.size(), 1U);
  const LoadedPass loaded = screened(read);
  expect_same_pass(loaded.pass, read_pass(directory_.path()).pass, 0, 0);
  EXPECT_TRUE(loaded.defects.empty());
}

TEST_F(PassInMemoryTest, IsCorrectedByWhatItsSettingsSayOfClocks) {
  const Pass uncorrected = read_pass(directory_.path()).pass;
  raw_.toml += "clock_offset_s = 1.5\nclock_rate_s_s = 1e-3\n[[gyro.unit]]\n[[gyro.unit]]\nlatency_s = 0.25\n";
  raw_.save_directory(directory_.path());
  const Pass expected = read_pass(directory_.path()).pass;
  const Pass pass = screened(tables()).pass;
  expect_same_pass(pass, expected, 0, 0);
  EXPECT_EQ(pass.settings.star_tracker_clock_offset_s, 1.5);
  EXPECT_EQ(pass.settings.star_tracker_clock_rate_s_s, 1e-3);
  EXPECT_EQ(pass.settings.gyros[0].latency_s, 0);
  EXPECT_EQ(pass.settings.gyros[1].latency_s, 0.25);
  EXPECT_NE(pass.star_tracker.t, uncorrected.star_tracker.t);
  EXPECT_NE(pass.gyro.h, uncorrected.gyro.h);
  // The tables of what was read so are corrected already, and are not corrected twice.
  expect_same_pass(screened(tables_of(pass, 1e-15)).pass, expected, 1e-15, 0);
}

TEST_F(PassInMemoryTest, IsScreenedAsAFileIs) {
  PassInMemory spoilt = tables();
  std::swap(spoilt.gyro.t_s[20], spoilt.gyro.t_s[21]);
  spoilt.star_trackers[0].values[4] = kNaN;
  const LoadedPass loaded = screened(spoilt);
  EXPECT_EQ(only(loaded.defects, Defect::Kind::kBackwardTime).count, 1);
  EXPECT_EQ(only(loaded.defects, Defect::Kind::kMissingValue).first[0].sample, 1);
}

TEST_F(PassInMemoryTest, KeepsAnEarlierCalibration) {
  PassInMemory with_prior = tables();
  Pass pass = read_pass(directory_.path()).pass;
  pass.settings.prior = sample_calibration();
  with_prior.prior = tables_of(pass, 1e-9).prior;
  ASSERT_TRUE(screened(with_prior).pass.settings.prior);
  EXPECT_EQ(screened(with_prior).pass.settings.prior->covariance, sample_calibration().covariance);
}

TEST_F(PassInMemoryTest, RefusesTablesThatDoNotFit) {
  PassInMemory other = tables();
  other.gyro.values.pop_back();
  EXPECT_THAT(refused(other), HasSubstr("of 6 columns; give as many rows of values as there are times"));
  other = tables();
  other.star_trackers.clear();
  EXPECT_THAT(refused(other), HasSubstr("has 0 tables of star trackers, and settings of 1"));
  other = tables();
  other.settings = "[pass]\n";
  EXPECT_THAT(refused(other), HasSubstr("pass_toml"));
  other = tables();
  other.prior = "{}";
  EXPECT_THAT(refused(other), HasSubstr("prior_json"));
}

TEST_F(PassInMemoryTest, OfASimulatedPassHasWhatItsFileHas) {
  const Pass pass = read_pass(directory_.path()).pass;
  constexpr double kStep = 1e-7;
  write_pass(directory_ / "pass.nc", pass, nullptr, {kStep});
  const LoadedPass written = read_pass(directory_ / "pass.nc");
  PassInMemory memory = tables_of(pass, kStep);
  memory.name = "memory";
  expect_same_pass(screened(memory).pass, written.pass, 0, 0);
}

TEST_F(PassInMemoryTest, ATruthComesBackAsItWas) {
  const Truth truth = clean_truth();
  const Time epoch = read_pass(directory_.path()).pass.settings.epoch;
  const Truth again = truth_of(tables_of(truth, epoch), "truth", epoch);
  EXPECT_EQ(again.t, truth.t);
  EXPECT_EQ(again.h_in, truth.h_in);
  EXPECT_EQ(again.gyros[0].drift_rad_s, truth.gyros[0].drift_rad_s);
  TruthInMemory wrong = tables_of(truth, epoch);
  wrong.parameters = "{}";
  EXPECT_NE(refusal([&] { static_cast<void>(truth_of(wrong, "truth", epoch)); }), "");
}

}  // namespace
}  // namespace trihedron::io
