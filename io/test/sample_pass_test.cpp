#include <gmock/gmock.h>

#include "fixtures.hpp"
#include "sample_passes.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::io {
namespace {

/// The sign of zero is the one thing that packing may lose. Texts with nine decimals or more.
std::string without_minus_zero(std::string text) {
  constexpr std::string_view kMinusZero = ",-0.000000000";
  for (std::size_t at = text.find(kMinusZero); at != std::string::npos; at = text.find(kMinusZero, at)) {
    text.erase(at + 1, 1);
  }
  return text;
}

class SamplePass : public testing::TestWithParam<PassOfKind> {};

INSTANTIATE_TEST_SUITE_P(All, SamplePass, testing::ValuesIn(all_sample_passes()),
                         [](const auto& pass) { return pass.param.identifier(); });

TEST_P(SamplePass, IsReadWholeAndComesBackFromBothFormats) {
  const std::filesystem::path& path = GetParam().path;
  const LoadedPass loaded = read_pass(path);
  for (const Defect& defect : loaded.defects) {
    EXPECT_TRUE(defect.kind == Defect::Kind::kSignFlip || defect.kind == Defect::Kind::kGap) << defect.text();
  }
  EXPECT_GT(loaded.pass.gyro.size(), 258'000U);
  EXPECT_GT(loaded.pass.star_tracker.size(), 9'000U);
  const auto truth = read_truth(path);
  ASSERT_TRUE(truth.has_value());

  const TemporaryDirectory directory;
  write_pass(directory / "pass.nc", loaded.pass, &*truth);
  write_pass(directory / "pass", read_pass(directory / "pass.nc").pass, &*truth);
  for (const char* name : {"gyro.csv", "star_tracker.csv", "truth.csv"}) {
    const std::string before = without_minus_zero(read_text(path / name));
    const std::string after = without_minus_zero(read_text(directory / "pass" / name));
    EXPECT_TRUE(before == after) << name << " changed on the way";
  }
  expect_same_pass(loaded.pass, read_pass(directory / "pass").pass, 0, 0);
}

/// What `simulate` has written in both formats.
class SimulatedSamplePass : public testing::TestWithParam<PassOfKind> {};

INSTANTIATE_TEST_SUITE_P(All, SimulatedSamplePass, testing::ValuesIn(own_sample_passes()),
                         [](const auto& pass) { return pass.param.identifier(); });

TEST_P(SimulatedSamplePass, HoldsTheSameInBothFormats) {
  const std::filesystem::path netcdf = GetParam().path.string() + ".nc";
  // Half a unit of the last decimal in CSV, and of direction cosines half a step of the packed values.
  expect_same_pass(read_pass(GetParam().path).pass, read_pass(netcdf).pass, 5e-10 + 2.5e-10 + 1e-15, 1e-10);
  const auto truth = read_truth(GetParam().path);
  const auto truth_of_netcdf = read_truth(netcdf);
  ASSERT_TRUE(truth.has_value() && truth_of_netcdf.has_value());
  EXPECT_EQ(truth->t, truth_of_netcdf->t);
  ASSERT_EQ(truth->h_in.size(), truth_of_netcdf->h_in.size());
  EXPECT_NEAR(truth->h_in.back(), truth_of_netcdf->h_in.back(), 1e-11);
  ASSERT_EQ(truth->gyros.size(), truth_of_netcdf->gyros.size());
  EXPECT_EQ(truth->gyros[1].drift_rad_s, truth_of_netcdf->gyros[1].drift_rad_s);
}

}  // namespace
}  // namespace trihedron::io
