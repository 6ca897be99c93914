#include "trihedron/io/named_pass.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "fixtures.hpp"

namespace trihedron::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class NamedPasses : public testing::Test {
 protected:
  /// The clean pass, begun at this hour.
  void save(const char* name, const char* hour) const {
    RawPass pass = clean_pass();
    pass.toml = replaced(pass.toml, "T00:00:00", std::string("T") + hour + ":00:00");
    std::filesystem::create_directories((directory_ / name).parent_path());
    if (std::string(name).ends_with(".nc")) {
      pass.save_netcdf(directory_ / name);
    } else {
      pass.save_directory(directory_ / name);
    }
  }
  [[nodiscard]] std::vector<std::string> names_of(const std::vector<std::string>& paths) const {
    std::vector<std::string> whole;
    for (const std::string& path : paths) {
      whole.push_back((directory_ / path.c_str()).string());
    }
    std::vector<std::string> names;
    for (const NamedPass& pass : read_passes(whole)) {
      names.push_back(pass.name);
    }
    return names;
  }
  TemporaryDirectory directory_;
};

TEST_F(NamedPasses, AreNamedByTheirFilesAndComeInTheOrderOfTheirEpochs) {
  save("late.nc", "12");
  save("early", "03");
  EXPECT_THAT(names_of({"late.nc", "early/"}), ElementsAre("early", "late"));
}

TEST_F(NamedPasses, OfTheSameNameAreNumberedAsTheyWereGiven) {
  save("a/pass.nc", "12");
  save("b/pass", "03");
  EXPECT_THAT(names_of({"a/pass.nc", "b/pass"}), ElementsAre("pass-2", "pass"));
}

TEST_F(NamedPasses, AreNamedByTheDirectoryThatDotsStandFor) {
  save("above/real", "03");
  std::filesystem::create_directory(directory_ / "above/real/below");
  std::filesystem::create_symlink("above/real", directory_ / "link");
  for (const char* path : {"above/real/.", "above/real/below/..", "above/real//", "link/.", "link/below/.."}) {
    EXPECT_THAT(names_of({path}), ElementsAre("real")) << path;
  }
  EXPECT_THAT(names_of({"link/"}), ElementsAre("link"));
  save("2009.05.20", "03");
  EXPECT_THAT(names_of({"2009.05.20"}), ElementsAre("2009.05.20"));
}

TEST_F(NamedPasses, HaveNamesThatNoOtherHas) {
  save("a/p", "01");
  save("b/p", "02");
  save("c/p-2", "03");
  save("d/report.html", "04");
  std::vector<std::string> names;
  const std::string_view reserved = "report.html";
  const std::vector<std::string> paths = {directory_ / "a/p", directory_ / "b/p", directory_ / "c/p-2",
                                          directory_ / "d/report.html"};
  for (const NamedPass& pass : read_passes(paths, {&reserved, 1})) {
    names.push_back(pass.name);
  }
  EXPECT_THAT(names, ElementsAre("p", "p-3", "p-2", "report.html-2"));
}

TEST_F(NamedPasses, HaveNamesThatAreTextAndNotTooLong) {
  save("a/\xff\x1b[1m\xc3\xa4\xed\xa0\x80", "01");
  EXPECT_THAT(names_of({"a/\xff\x1b[1m\xc3\xa4\xed\xa0\x80"}), ElementsAre("%FF%1B[1m\xc3\xa4%ED%A0%80"));
  save("a/.trihedron-new", "01");
  EXPECT_THAT(names_of({"a/.trihedron-new"}), ElementsAre("trihedron-new"));
  // 255 bytes, with characters of three each at the end.
  std::string longest(255 - 9, 'n');
  longest += "\xe2\x82\xac\xe2\x82\xac\xe2\x82\xac";
  save(("b/" + longest).c_str(), "01");
  save(("c/" + longest).c_str(), "02");
  EXPECT_THAT(names_of({"b/" + longest, "c/" + longest}), ElementsAre(longest, longest.substr(0, 252) + "-2"));
}

TEST_F(NamedPasses, HaveATruthOnlyWhereThereIsOne) {
  save("pass", "00");
  const NamedPass without = read_named_pass(directory_ / "pass");
  EXPECT_EQ(without.truth_or_null(), nullptr);
  const Truth truth = clean_truth();
  write_pass(directory_ / "with.nc", without.pass(), &truth);
  const NamedPass with = read_named_pass(directory_ / "with.nc");
  ASSERT_NE(with.truth_or_null(), nullptr);
  EXPECT_EQ(with.truth_or_null()->gyros.size(), 2U);
}

TEST_F(NamedPasses, HaveTheTruthBetweenTheEndsOfTheSelection) {
  save("pass", "00");
  const Pass pass = read_pass(directory_ / "pass").pass;
  Truth whole = clean_truth();
  ASSERT_GE(whole.t.size(), 27U);
  for (std::size_t i = 0; i < whole.h_in.size(); ++i) {
    whole.h_in[i] += 1e-6 * static_cast<double>(i);  // tells one row from another
  }
  write_pass(directory_ / "with.nc", pass, &whole);
  const auto truth_of = [&](const Selection& selection) {
    return read_named_pass(directory_ / "with.nc", TruthUse::kNeeded, selection).truth;
  };

  const std::optional<Truth> read = truth_of({});
  ASSERT_TRUE(read.has_value());
  const std::optional<Truth> some = truth_of({whole.t[5], whole.t[26], {}});
  ASSERT_TRUE(some.has_value());
  EXPECT_EQ(some->t, std::vector<Time>(whole.t.begin() + 5, whole.t.begin() + 27));
  EXPECT_EQ(some->q_in_c.size(), 22U);
  EXPECT_EQ(some->h_in, std::vector<double>(read->h_in.begin() + 5 * 6, read->h_in.begin() + 27 * 6));
}

TEST_F(NamedPasses, HaveATruthThatCountsFromTheEpochOfTheSelection) {
  save("pass", "00");
  Truth whole = clean_truth();
  whole.orbital_rate_rad_s = 0.04;
  write_pass(directory_ / "with.nc", read_pass(directory_ / "pass").pass, &whole);
  const Selection selection{whole.t[5], {}, {}};
  const std::optional<Truth> some = read_named_pass(directory_ / "with.nc", TruthUse::kNeeded, selection).truth;
  ASSERT_TRUE(some.has_value());
  const auto error_at = [](const Truth& truth, double t_s) -> Eigen::Vector3d {
    const Truth::StarTracker& head = truth.star_trackers[0];
    const double phase = truth.orbital_rate_rad_s * t_s;
    return std::sin(phase) * head.orbital_sine_rad + std::cos(phase) * head.orbital_cosine_rad;
  };
  const double moved_s = to_seconds(whole.t[5] - whole.t[0]);
  EXPECT_LT((error_at(*some, 20) - error_at(whole, 20 + moved_s)).norm(), 1e-15);
  const Truth::StarTracker& before = whole.star_trackers[0];
  EXPECT_DOUBLE_EQ(some->star_trackers[0].clock_offset_s, before.clock_offset_s + before.clock_rate_s_s * moved_s);
}

TEST_F(NamedPasses, RefuseATruthOfAnotherNumberOfGyros) {
  save("pass", "00");
  const Pass pass = read_pass(directory_ / "pass").pass;
  Truth truth = clean_truth();
  truth.gyros.push_back(truth.gyros.back());
  std::vector<double> h_in;
  for (std::size_t i = 0; i < truth.t.size(); ++i) {
    h_in.insert(h_in.end(), {1, 0, 0, 0, 1, 0, 0, 0, 1});
  }
  truth.h_in = h_in;
  write_pass(directory_ / "three.nc", pass, &truth);
  EXPECT_THAT(refusal([&] { static_cast<void>(read_named_pass(directory_ / "three.nc")); }),
              HasSubstr("the truth has 3 gyros, the telemetry 2"));
}

TEST_F(NamedPasses, AreReadWithoutATruthOfWhichAPartIsMissingWhereItIsOnlyCompared) {
  save("pass", "00");
  const auto expect_told = [&](const std::string& what) {
    EXPECT_THAT(refusal([&] { static_cast<void>(read_named_pass(directory_ / "pass")); }),
                HasSubstr(what.substr(0, what.find(' '))));
    const NamedPass pass = read_named_pass(directory_ / "pass", TruthUse::kToCompare);
    EXPECT_EQ(pass.truth_or_null(), nullptr);
    ASSERT_FALSE(pass.loaded.defects.empty());
    EXPECT_EQ(pass.loaded.defects.back().kind, Defect::Kind::kTruthIncomplete);
    EXPECT_EQ(pass.loaded.defects.back().text(), what + ": 1 truth that is not whole, nothing is compared with it.");
  };
  write_file(directory_ / "pass" / "truth.csv", "t_s,q_x,q_y,q_z,q_w\n0,0,0,0,1\n");
  expect_told("truth.json (is missing beside truth.csv)");
  write_file(directory_ / "pass" / "truth.json", "{}");
  expect_told("truth.csv (lacks column \"h1_x\")");
  write_file(directory_ / "pass" / "truth.csv",
             "t_s,q_x,q_y,q_z,q_w,h1_x,h1_y,h1_z,h2_x,h2_y,h2_z\n0,0,0,0,1,1,0,0,0,1,0\n");
  expect_told("truth.json (lacks key \"gyros\")");
  std::filesystem::remove(directory_ / "pass" / "truth.csv");
  expect_told("truth.csv (is missing beside truth.json)");
  // What is broken is refused.
  write_file(directory_ / "pass" / "truth.csv",
             "t_s,q_x,q_y,q_z,q_w,h1_x,h1_y,h1_z,h2_x,h2_y,h2_z\n0,x,0,0,1,1,0,0,0,1,0\n");
  write_file(directory_ / "pass" / "truth.json", "{");
  EXPECT_THROW(static_cast<void>(read_named_pass(directory_ / "pass", TruthUse::kToCompare)), InputRefused);
}

}  // namespace
}  // namespace trihedron::io
