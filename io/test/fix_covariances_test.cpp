#include <gmock/gmock.h>

#include <cmath>

#include "fixtures.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::io::fix_covariances_test {
namespace {

using testing::HasSubstr;

constexpr std::array<double, 6> kUsual = {4e-10, 9e-10, 1e-8, 1e-10, -5e-11, 3e-10};

/// The clean pass, the covariance of each fix larger by 1 % than that of the one before.
RawPass with_covariances(std::size_t columns) {
  constexpr std::array kNames = {"cov_xx_rad2", "cov_yy_rad2", "cov_zz_rad2",
                                 "cov_xy_rad2", "cov_xz_rad2", "cov_yz_rad2"};
  RawPass raw = clean_pass();
  double factor = 1;
  raw.star_tracker.columns.insert(raw.star_tracker.columns.end(), kNames.begin(), kNames.begin() + columns);
  for (std::vector<double>& row : raw.star_tracker.rows) {
    for (std::size_t i = 0; i < columns; ++i) {
      row.push_back(factor * kUsual[i]);
    }
    factor *= 1.01;
  }
  return raw;
}

class FixCovariances : public testing::Test {
 protected:
  [[nodiscard]] LoadedPass loaded(const RawPass& raw) {
    raw.save_directory(directory_ / "pass");
    return read_pass(directory_ / "pass");
  }
  std::string refusal_of(const RawPass& raw) {
    return refusal([&] { static_cast<void>(loaded(raw)); });
  }

  TemporaryDirectory directory_;
};

void expect_same_covariances(const std::vector<FixCovariance>& a, const std::vector<FixCovariance>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].rad2, b[i].rad2) << i;
  }
}

TEST_F(FixCovariances, AreReadWithTheFixesAndComeBackFromEveryFormat) {
  const RawPass raw = with_covariances(6);
  const LoadedPass read = loaded(raw);
  EXPECT_TRUE(read.defects.empty());
  const std::vector<FixCovariance>& its = read.pass.star_tracker.covariances;
  ASSERT_EQ(its.size(), read.pass.star_tracker.size());
  EXPECT_EQ(its.front().rad2, kUsual);
  EXPECT_EQ(its.back().rad2[5], raw.star_tracker.rows.back().back());
  const StarFix fix = read.pass.star_tracker.fix(0, 0);
  EXPECT_EQ(fix.covariance.matrix()(0, 2), kUsual[4]);
  EXPECT_EQ(fix.covariance.matrix()(2, 1), kUsual[5]);

  raw.save_netcdf(directory_ / "others.nc");
  expect_same_covariances(read_pass(directory_ / "others.nc").pass.star_tracker.covariances, its);
  for (const char* const name : {"again", "again.nc"}) {
    write_pass(directory_ / name, read.pass, nullptr);
    expect_same_covariances(read_pass(directory_ / name).pass.star_tracker.covariances, its);
  }
  for (const PassInMemory& tables : {read_tables(directory_ / "pass"), tables_of(read.pass, 1e-9)}) {
    EXPECT_TRUE(tables.star_trackers.front().has_covariances);
    expect_same_covariances(screened(tables).pass.star_tracker.covariances, its);
  }
}

TEST_F(FixCovariances, MayBeVariancesAlone) {
  const LoadedPass read = loaded(with_covariances(3));
  EXPECT_EQ(read.pass.star_tracker.covariances.front().rad2, (std::array{4e-10, 9e-10, 1e-8, 0.0, 0.0, 0.0}));
  expect_same_covariances(screened(read_tables(directory_ / "pass")).pass.star_tracker.covariances,
                          read.pass.star_tracker.covariances);
}

TEST_F(FixCovariances, AreNotThereWhereTheTableHasNone) {
  const LoadedPass read = loaded(clean_pass());
  EXPECT_TRUE(read.pass.star_tracker.covariances.empty());
  EXPECT_FALSE(read.pass.star_tracker.fix(0, 0).covariance.is_told());
}

TEST_F(FixCovariances, ThatCannotBeUsedAreCountedAndTheNoiseOfTheSettingsTaken) {
  RawPass raw = with_covariances(6);
  const auto spoil = [&](std::size_t fix, std::size_t element, double value) {
    raw.star_tracker.rows[fix][5 + element] = value;
  };
  spoil(1, 0, kNaN);
  spoil(2, 4, kNaN);
  spoil(3, 1, -9e-10);
  spoil(4, 3, 7e-10);  // correlation 1.1 of x and y
  spoil(5, 2, 0);
  spoil(6, 2, 1);       // a radian
  spoil(7, 4, 1.9e-9);  // each pair could be, not the three
  spoil(7, 5, -2.8e-9);
  const LoadedPass read = loaded(raw);
  const Defect defect = only(read.defects, Defect::Kind::kNoCovariance);
  EXPECT_EQ(defect.count, 7);
  EXPECT_EQ(defect.first.front().line, 3);
  EXPECT_STREQ(name_of(defect.kind), "no-covariance");
  EXPECT_THAT(defect.text(), HasSubstr("7 fixes without a covariance that can be used"));
  const std::vector<FixCovariance>& its = read.pass.star_tracker.covariances;
  for (std::size_t i = 0; i < its.size(); ++i) {
    EXPECT_EQ(its[i].is_told(), i == 0 || i > 7) << i;
  }
  // Written and read again they are the same ones.
  write_pass(directory_ / "again.nc", read.pass, nullptr);
  write_pass(directory_ / "again", read.pass, nullptr);
  for (const char* const name : {"again", "again.nc"}) {
    const LoadedPass again = read_pass(directory_ / name);
    EXPECT_EQ(only(again.defects, Defect::Kind::kNoCovariance).count, 7);
    expect_same_covariances(again.pass.star_tracker.covariances, its);
  }
}

TEST_F(FixCovariances, OfWhichSomeColumnsAreMissingAreRefused) {
  EXPECT_THAT(refusal_of(with_covariances(2)), HasSubstr("lacks column \"cov_zz_rad2\""));
  EXPECT_THAT(refusal_of(with_covariances(5)), HasSubstr("lacks column \"cov_yz_rad2\""));
}

}  // namespace
}  // namespace trihedron::io::fix_covariances_test
