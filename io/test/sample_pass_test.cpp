#include <gmock/gmock.h>

#include "fixtures.hpp"
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

/// The sample passes are no part of the product: without them there is nothing to check here.
class SamplePass : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(path_)) {
      GTEST_SKIP() << "no sample passes at " << path_;
    }
  }
  const std::filesystem::path path_ = std::filesystem::path(TRIHEDRON_SAMPLE_PASSES) / GetParam();
};

INSTANTIATE_TEST_SUITE_P(All, SamplePass, testing::Values("pass-a", "pass-b", "pass-c", "pass-d"),
                         [](const auto& name) { return std::string(1, name.param.back()); });

TEST_P(SamplePass, IsReadWholeAndComesBackFromBothFormats) {
  const LoadedPass loaded = read_pass(path_);
  for (const Defect& defect : loaded.defects) {
    EXPECT_TRUE(defect.kind == Defect::Kind::kSignFlip || defect.kind == Defect::Kind::kGap) << defect.text();
  }
  EXPECT_GT(loaded.pass.gyro.size(), 258'000U);
  EXPECT_GT(loaded.pass.star_tracker.size(), 9'000U);
  const auto truth = read_truth(path_);
  ASSERT_TRUE(truth.has_value());

  const TemporaryDirectory directory;
  write_pass(directory / "pass.nc", loaded.pass, &*truth);
  write_pass(directory / "pass", read_pass(directory / "pass.nc").pass, &*truth);
  for (const char* name : {"gyro.csv", "star_tracker.csv", "truth.csv"}) {
    const std::string before = without_minus_zero(read_text(path_ / name));
    const std::string after = without_minus_zero(read_text(directory / "pass" / name));
    EXPECT_TRUE(before == after) << name << " changed on the way";
  }
  expect_same_pass(loaded.pass, read_pass(directory / "pass").pass, 0, 0);
}

}  // namespace
}  // namespace trihedron::io
