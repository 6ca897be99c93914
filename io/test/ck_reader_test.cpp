#include "ck_reader.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <random>

#include "fixtures.hpp"
#include "trihedron/io/attitude.hpp"
#include "trihedron/io/scenario.hpp"
#include "trihedron/io/spice_kernels.hpp"

namespace trihedron::io::ck_reader_test {
namespace {

using testing::HasSubstr;

/// A body that turns unevenly, in three stretches.
AttitudeHistory turning() {
  AttitudeHistory attitude;
  for (int i = 0; i < 330; ++i) {
    const double t_s = 0.125 * i + (i < 120 ? 0 : i < 121 ? 10 : 30);
    attitude.t.push_back(sample_calibration().epoch + from_seconds(t_s + 0.0625));
    attitude.q_in_c.emplace_back(
        Eigen::AngleAxisd(0.02 * t_s + 0.1 * std::sin(t_s), Eigen::Vector3d(1, -2, 0.5).normalized()));
  }
  return attitude;
}

struct Kernels {
  AttitudeHistory attitude = turning();
  std::string pointing;
  std::string clock;

  Kernels() {
    const SpiceClock its = SpiceClock::of(attitude);
    const SpiceObject object{-28380, "TEST"};
    pointing = format_ck(attitude, {}, its, object, stretches(attitude, std::chrono::seconds(1)));
    clock = format_sclk(its, object);
  }
  [[nodiscard]] AttitudeMessage read() const { return parse_c_kernel(pointing, "a.bc", clock, "a.tsc"); }
  [[nodiscard]] std::string refused() const {
    return refusal([&] { static_cast<void>(read()); });
  }
  template <class T>
  void put(std::size_t at, T value) {
    std::memcpy(&pointing[at], &value, sizeof value);
  }
};

void expect_same(const AttitudeMessage& message, const AttitudeHistory& attitude) {
  EXPECT_EQ(message.attitude.t, attitude.t);  // to the nanosecond
  ASSERT_EQ(message.attitude.size(), attitude.size());
  for (std::size_t i = 0; i < attitude.size(); ++i) {
    EXPECT_LT((message.attitude.q_in_c[i].coeffs() - attitude.q_in_c[i].coeffs()).norm(), 1e-15);
  }
}

TEST(CKernel, GivesBackWhatWasWritten) {
  const Kernels kernels;
  const AttitudeMessage message = kernels.read();
  expect_same(message, kernels.attitude);
  EXPECT_EQ(message.format, "SPICE CK of type 3");
  EXPECT_EQ(message.inertial_frame, "J2000");
  EXPECT_EQ(message.time_system, "TT");
  EXPECT_EQ(message.segments, 3U);
  const std::vector<Eigen::Vector3d> rates =
      rates_of(kernels.attitude, {}, stretches(kernels.attitude, std::chrono::seconds(1)));
  ASSERT_EQ(message.rate_rad_s.size(), rates.size());
  for (std::size_t i = 0; i < rates.size(); ++i) {
    EXPECT_LT((message.rate_rad_s[i] - rates[i]).norm(), 1e-15);  // c axes again
  }
}

TEST(CKernel, ReadsTheOtherOrderOfBytes) {
  Kernels kernels;
  // Words of doubles, but the integers of the file record and of the summary.
  std::string& bytes = kernels.pointing;
  for (std::size_t at = 1024; at < bytes.size(); at += 8) {
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.begin() + static_cast<std::ptrdiff_t>(at) + 8);
  }
  constexpr std::size_t kIntegersOfSummary = 1024 + 5 * 8;
  for (std::size_t at = kIntegersOfSummary; at < kIntegersOfSummary + 24; at += 8) {
    std::rotate(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.begin() + static_cast<std::ptrdiff_t>(at) + 4,
                bytes.begin() + static_cast<std::ptrdiff_t>(at) + 8);
  }
  for (const std::size_t at : {8U, 12U, 76U, 80U, 84U}) {
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.begin() + static_cast<std::ptrdiff_t>(at) + 4);
  }
  bytes.replace(88, 8, "BIG-IEEE");
  expect_same(kernels.read(), kernels.attitude);
}

TEST(CKernel, IsAnAttitudeFileWithItsClockBesideIt) {
  const TemporaryDirectory directory;
  const Kernels kernels;
  write_text(directory / "a.bc", kernels.pointing);
  EXPECT_THAT(refusal([&] { static_cast<void>(read_attitude(directory / "a.bc", Time{})); }),
              HasSubstr("its clock " + (directory / "a.tsc").string() + " is not there"));
  write_text(directory / "a.tsc", kernels.clock);
  EXPECT_EQ(read_attitude(directory / "a.bc", Time{}).t, kernels.attitude.t);
  write_text(directory / "scenario.toml", "[attitude]\nreference = \"recorded\"\nrecorded = \"a.bc\"\n");
  const Scenario scenario = read_scenario(directory / "scenario.toml");
  ASSERT_EQ(scenario.attitude.recorded.size(), kernels.attitude.size());
  EXPECT_EQ(scenario.attitude.recorded.front().t_s, to_seconds(kernels.attitude.t.front() - scenario.epoch));
}

TEST(CKernel, RefusesClocksThatAreNone) {
  const auto refused = [](std::string_view from, std::string_view to) {
    Kernels kernels;
    kernels.clock = replaced(kernels.clock, from, to);
    return kernels.refused();
  };
  EXPECT_THAT(refused("KPL/SCLK", "KPL SCLK"), HasSubstr("does not begin with KPL/"));
  EXPECT_THAT(refused("SCLK_DATA_TYPE_28380", "SCLK_DATA_TYPE_28381"), HasSubstr("has no SCLK_DATA_TYPE_28380"));
  EXPECT_THAT(refused("SCLK_DATA_TYPE_28380 = ( 1 )", "SCLK_DATA_TYPE_28380 = ( 2 )"),
              HasSubstr("another type than 1"));
  EXPECT_THAT(refused("SCLK01_TIME_SYSTEM_28380 = ( 2 )", "SCLK01_TIME_SYSTEM_28380 = ( 3 )"), HasSubstr("neither 1"));
  EXPECT_THAT(refused("( 9007199 1000000000 )", "( 9007199 0 )"), HasSubstr("moduli"));
  EXPECT_THAT(refused("1.0E+00 )", "1.0E+00 5 )"), HasSubstr("not in threes"));
  EXPECT_THAT(refused("1.0E+00 )", "-1.0E+00 )"), HasSubstr("cannot be, or are out of order"));
  EXPECT_THAT(refused("1.0E+00 )", "1.0E+00"), HasSubstr("ends within a list"));
  EXPECT_THAT(refused("1.0E+00 )", "1.0E+0O )"), HasSubstr("\"1.0E+0O\" is not a number"));
  EXPECT_THAT(refused("SCLK01_OFFSETS_28380 =", "SCLK01_OFFSETS_28380"), HasSubstr("is no assignment"));
  EXPECT_THAT(refused("COEFFICIENTS_28380 = ( 0.0E+00", "COEFFICIENTS_28380 = ( 1.0D+15"), HasSubstr("does not know"));
}

TEST(CKernel, RefusesKernelsThatAreNone) {
  constexpr std::size_t kSummary = 1024 + 3 * 8;
  const auto refused = [](auto spoil) {
    Kernels kernels;
    spoil(kernels);
    return kernels.refused();
  };
  EXPECT_THAT(refused([](Kernels& k) { k.pointing.pop_back(); }), HasSubstr("bytes, which no kernel has"));
  EXPECT_THAT(refused([](Kernels& k) { k.pointing.replace(88, 8, "VAX-GFLT"); }), HasSubstr("VAX-GFLT"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(8, std::int32_t{3}); }), HasSubstr("no summaries of pointing"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(76, std::int32_t{0}); }), HasSubstr("holds no pointing"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(76, std::int32_t{9999}); }), HasSubstr("record of summaries"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(1024, 2.0); }), HasSubstr("lead back to each other"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(1024 + 16, 26.0); }), HasSubstr("number of summaries"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(kSummary + 20, std::int32_t{2}); }), HasSubstr("relative to frame 2"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(kSummary + 24, std::int32_t{2}); }), HasSubstr("is a CK of type 2"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(kSummary + 28, std::int32_t{0}); }), HasSubstr("attitudes take"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(kSummary + 32, std::int32_t{-1}); }), HasSubstr("address"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(3 * 1024, 2.0); }), HasSubstr("has the norm"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(3 * 1024 + 32, std::nan("")); }), HasSubstr("angular velocity"));
  EXPECT_THAT(refused([](Kernels& k) { k.put(3 * 1024 + 330 * 56 + 8, 0.0); }), HasSubstr("is not later than"));
}

TEST(CKernel, ReadsOrRefusesDamagedKernels) {
  const Kernels whole;
  int refused = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    std::mt19937 random(seed);
    const auto below = [&](std::size_t end) { return std::uniform_int_distribution<std::size_t>(0, end - 1)(random); };
    Kernels spoilt = whole;
    std::string& text = seed % 4 == 0 ? spoilt.clock : spoilt.pointing;
    for (std::size_t times = 1 + below(3); times > 0; --times) {
      const std::size_t at = seed % 2 == 0 ? below(text.size()) : below(std::min(text.size(), std::size_t{1200}));
      text[at] = static_cast<char>(below(256));
    }
    if (seed % 5 == 0) {
      text.resize(below(text.size()));
    }
    const std::string said = spoilt.refused();
    refused += said.empty() ? 0 : 1;
    EXPECT_TRUE(said.empty() || (said.starts_with("a.") && said.find("; ") != std::string::npos)) << seed << said;
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace trihedron::io::ck_reader_test
