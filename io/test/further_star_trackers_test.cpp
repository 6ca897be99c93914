#include <gmock/gmock.h>

#include <cmath>

#include "fixtures.hpp"
#include "trihedron/io/pass.hpp"

namespace trihedron::io {
namespace {

using testing::HasSubstr;

constexpr const char* kHead = R"(
[[star_tracker.further]]
noise_rad = [1e-5, 1e-5, 5e-5]
mounting_rotation_vector_rad = [1.5, 0, -0.25]
alignment_prior_sigma_rad = 3e-4
)";

class FurtherStarTrackers : public testing::Test {
 protected:
  FurtherStarTrackers() {
    RawPass raw = clean_pass();
    raw.toml += kHead;
    raw.save_directory(directory_ / "raw");
    write_text(directory_ / "raw/star_tracker_2.csv", "t_s,q_x,q_y,q_z,q_w\n0,0,0,0,1\n3,0,0,0.6,0.8\n");
  }
  std::string refusal_with(std::string_view toml) {
    write_text(directory_ / "raw/pass.toml", toml);
    return refusal([&] { static_cast<void>(read_pass(directory_ / "raw")); });
  }
  TemporaryDirectory directory_;
};

TEST_F(FurtherStarTrackers, AreReadBesideTheFirstAndScreened) {
  const LoadedPass loaded = read_pass(directory_ / "raw");
  ASSERT_EQ(loaded.pass.settings.further_star_trackers.size(), 1U);
  const FurtherStarTracker& head = loaded.pass.settings.further_star_trackers[0];
  EXPECT_EQ(head.noise_rad, Eigen::Vector3d(1e-5, 1e-5, 5e-5));
  EXPECT_EQ(head.mounting_rotation_vector_rad, Eigen::Vector3d(1.5, 0, -0.25));
  EXPECT_EQ(head.alignment_prior_sigma_rad, 3e-4);
  ASSERT_EQ(loaded.pass.further_star_trackers.size(), 1U);
  EXPECT_EQ(loaded.pass.further_star_trackers[0].q_in_c[1].z(), 0.6);
  EXPECT_EQ(only(loaded.defects, Defect::Kind::kGap).where, "star_tracker_2.csv");
}

TEST_F(FurtherStarTrackers, ComeBackFromBothFormats) {
  const Pass pass = read_pass(directory_ / "raw").pass;
  for (const char* name : {"again", "again.nc"}) {
    write_pass(directory_ / name, pass, nullptr);
    const Pass again = read_pass(directory_ / name).pass;
    ASSERT_EQ(again.settings.further_star_trackers.size(), 1U);
    EXPECT_EQ(again.settings.further_star_trackers[0].mounting_rotation_vector_rad,
              pass.settings.further_star_trackers[0].mounting_rotation_vector_rad);
    ASSERT_EQ(again.further_star_trackers.size(), 1U);
    EXPECT_EQ(again.further_star_trackers[0].t, pass.further_star_trackers[0].t);
    EXPECT_EQ(again.further_star_trackers[0].q_in_c[1].coeffs(), pass.further_star_trackers[0].q_in_c[1].coeffs());
  }
}

TEST_F(FurtherStarTrackers, TableOfAHeadMustBeThere) {
  std::filesystem::remove(directory_ / "raw/star_tracker_2.csv");
  EXPECT_THAT(refusal([&] { static_cast<void>(read_pass(directory_ / "raw")); }),
              HasSubstr("star_tracker_2.csv: cannot be opened"));
}

TEST_F(FurtherStarTrackers, RefusesSettingsThatAreNotOnePerHead) {
  const std::string toml = clean_pass().toml;
  EXPECT_THAT(refusal_with(toml + "further = 2\n"), HasSubstr("begin the part of each further head with"));
  EXPECT_THAT(refusal_with(toml + replaced(kHead, "noise_rad", "noise")), HasSubstr("noise"));
  EXPECT_THAT(refusal_with(toml + replaced(kHead, "[1e-5, 1e-5, 5e-5]", "[1e-5, 1e-5, 0]")), HasSubstr("noise_rad"));
  EXPECT_THAT(refusal_with(toml + replaced(kHead, "alignment_prior_sigma_rad = 3e-4", "")),
              HasSubstr("alignment_prior_sigma_rad"));
}

}  // namespace
}  // namespace trihedron::io
