#include <gmock/gmock.h>

#include "fixtures.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::io {
namespace {

using testing::HasSubstr;

constexpr const char* kJson = R"({"convention": "any", "orbital_rate_rad_s": 1e-3, "gyros": [
  {"drift_rad_s": [1e-6, 2e-6, 3e-6, 4e-6, 5e-6, 6e-6, 7e-6], "lambda_rad": [1e-3, 2e-3, 3e-3], "unmodelled_rad_s": [1e-8]},
  {"drift_rad_s": [0, 0, 0, 0, 0, 0, 0], "lambda_rad": [0, 0, 0], "unmodelled_rad_s": []}]})";
constexpr const char* kTable =
    "t_s,q_x,q_y,q_z,q_w,h1_x,h1_y,h1_z,h2_x,h2_y,h2_z\n0,0,0,0,1,1,0,0,0,1,0\n3,0,0,0.6,0.8,1,0,0,0,0.6,0.8\n";

class TruthFiles : public testing::Test {
 protected:
  TruthFiles() {
    clean_pass().save_directory(directory_.path());
    write_text(directory_ / "truth.csv", kTable);
    write_text(directory_ / "truth.json", kJson);
  }
  std::string refusal_with(const char* name, std::string_view text) {
    write_text(directory_ / name, text);
    return refusal([&] { static_cast<void>(read_truth(directory_.path())); });
  }
  TemporaryDirectory directory_;
};

TEST_F(TruthFiles, AreRead) {
  const auto truth = read_truth(directory_.path());
  ASSERT_TRUE(truth.has_value());
  ASSERT_EQ(truth->gyros.size(), 2U);
  EXPECT_EQ(truth->gyros[0].drift_rad_s[4], (std::pair(DriftCoefficient::of_eq1(Esg7::kNu12), 5e-6)));
  EXPECT_EQ(truth->gyros[0].alignment_rotation_vector_rad, Eigen::Vector3d(1e-3, 2e-3, 3e-3));
  EXPECT_EQ(truth->gyros[0].unmodelled_rad_s.size(), 1U);
  EXPECT_EQ(truth->t[1] - truth->t[0], std::chrono::seconds(3));
  EXPECT_EQ(truth->q_in_c[1].z(), 0.6);
  EXPECT_EQ(truth->h_in[11], 0.8);
  EXPECT_EQ(truth->orbital_rate_rad_s, 1e-3);
  EXPECT_TRUE(truth->star_trackers.empty());
}

TEST_F(TruthFiles, AbsenceIsNoError) {
  std::filesystem::remove(directory_ / "truth.csv");
  std::filesystem::remove(directory_ / "truth.json");
  EXPECT_FALSE(read_truth(directory_.path()).has_value());
  EXPECT_THAT(refusal([] { static_cast<void>(read_truth("no-such-pass")); }), HasSubstr("there is no such file"));
}

TEST_F(TruthFiles, HalfATruthIsRefused) {
  std::filesystem::remove(directory_ / "truth.csv");
  EXPECT_THAT(refusal([&] { static_cast<void>(read_truth(directory_.path())); }),
              HasSubstr("truth.csv: is missing beside truth.json; give both, or none"));
  write_text(directory_ / "truth.csv", kTable);
  std::filesystem::remove(directory_ / "truth.json");
  EXPECT_THAT(refusal([&] { static_cast<void>(read_truth(directory_.path())); }),
              HasSubstr("truth.json: is missing beside truth.csv; give both, or none"));
}

TEST_F(TruthFiles, BrokenParametersAreRefused) {
  EXPECT_THAT(refusal_with("truth.json", "{\n \"gyros\": [}"), HasSubstr("truth.json:2:12: is not valid JSON here"));
  EXPECT_THAT(refusal_with("truth.json", "{}"), HasSubstr("truth.json: lacks key \"gyros\""));
  EXPECT_THAT(refusal_with("truth.json", replaced(kJson, ", 7e-6]", "]")),
              HasSubstr("gyros[0].drift_rad_s has 6 elements"));
  EXPECT_THAT(refusal_with("truth.json", replaced(kJson, "[1e-3, 2e-3, 3e-3]", "[1e-3, 2e-3]")),
              HasSubstr("gyros[0].lambda_rad has 2 elements"));
  EXPECT_THAT(refusal_with("truth.json", replaced(kJson, "[1e-8]", "[null]")),
              HasSubstr("gyros[0].unmodelled_rad_s[0] is null; make it a finite number"));
  EXPECT_THAT(refusal_with("truth.json", replaced(kJson, "[1e-8]", "[1e-8], \"unmodelled_names\": []")),
              HasSubstr("has 0 names for 1 values"));
  EXPECT_THAT(refusal_with("truth.json", R"({"gyros": []})"), HasSubstr("gyros has 0 elements, truth.csv has 2 gyros"));
}

TEST_F(TruthFiles, BrokenTableIsRefused) {
  const std::string table = kTable;
  EXPECT_THAT(refusal_with("truth.csv", replaced(table, "0.6,0.8,1", "nan,0.8,1")),
              HasSubstr("truth.csv:3: a value is missing"));
  EXPECT_THAT(refusal_with("truth.csv", replaced(table, "\n3,", "\n0,")),
              HasSubstr("truth.csv:3: the time stamp does not increase"));
  EXPECT_THAT(refusal_with("truth.csv", table + "6,0,0"), HasSubstr("truth.csv:4: the last line is cut short"));
  EXPECT_THAT(refusal_with("truth.csv", replaced(table, "h2_z", "h3_z")), HasSubstr("lacks column \"h2_z\""));
}

TEST_F(TruthFiles, ComeBackFromBothFormats) {
  const Pass pass = read_pass(directory_.path()).pass;
  const Truth truth = clean_truth();
  for (const char* name : {"copy", "copy.nc"}) {
    write_pass(directory_ / name, pass, &truth);
    const auto back = read_truth(directory_ / name);
    ASSERT_TRUE(back.has_value()) << name;
    EXPECT_EQ(back->t, truth.t);
    for (std::size_t i = 0; i < truth.gyros.size(); ++i) {
      EXPECT_EQ(back->gyros[i].drift_rad_s, truth.gyros[i].drift_rad_s);
      EXPECT_EQ(back->gyros[i].unmodelled_rad_s, truth.gyros[i].unmodelled_rad_s);
      EXPECT_EQ(back->gyros[i].alignment_rotation_vector_rad, truth.gyros[i].alignment_rotation_vector_rad);
    }
    EXPECT_EQ(back->orbital_rate_rad_s, truth.orbital_rate_rad_s);
    ASSERT_EQ(back->star_trackers.size(), truth.star_trackers.size());
    for (std::size_t i = 0; i < truth.star_trackers.size(); ++i) {
      EXPECT_EQ(back->star_trackers[i].clock_offset_s, truth.star_trackers[i].clock_offset_s);
      EXPECT_EQ(back->star_trackers[i].clock_rate_s_s, truth.star_trackers[i].clock_rate_s_s);
      EXPECT_EQ(back->star_trackers[i].orbital_sine_rad, truth.star_trackers[i].orbital_sine_rad);
      EXPECT_EQ(back->star_trackers[i].orbital_cosine_rad, truth.star_trackers[i].orbital_cosine_rad);
      EXPECT_EQ(back->star_trackers[i].misalignment_rad, truth.star_trackers[i].misalignment_rad);
    }
    EXPECT_EQ(back->h_in, truth.h_in);
    for (std::size_t i = 0; i < truth.t.size(); ++i) {
      EXPECT_LE((back->q_in_c[i].coeffs() - truth.q_in_c[i].coeffs()).cwiseAbs().maxCoeff(),
                5.01e-13);  // twelve decimals
    }
  }
  write_pass(directory_ / "none.nc", pass, nullptr);
  EXPECT_FALSE(read_truth(directory_ / "none.nc").has_value());
}

}  // namespace
}  // namespace trihedron::io
