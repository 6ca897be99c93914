#include "trihedron/io/attitude.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "fixtures.hpp"
#include "trihedron/io/attitude_message.hpp"

namespace trihedron::io {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

class AttitudeCsv : public testing::Test {
 protected:
  AttitudeHistory read(std::string_view text) {
    write_text(directory_ / "a.csv", text);
    return read_attitude(directory_ / "a.csv", epoch_);
  }
  std::string refusal_of(std::string_view text) {
    return refusal([&] { static_cast<void>(read(text)); });
  }
  std::string written(const AttitudeHistory& attitude) {
    write_attitude(directory_ / "a.csv", epoch_, attitude);
    return read_text(directory_ / "a.csv");
  }

  TemporaryDirectory directory_;
  Time epoch_{std::chrono::days(18767)};
};

TEST_F(AttitudeCsv, IsWrittenWithFixedDecimals) {
  const Eigen::Quaterniond q(0.8, 0, -0.6, 0);
  EXPECT_EQ(
      written({{epoch_, epoch_ + std::chrono::milliseconds(3125), epoch_ + Duration(3125000001)},
               {q, q, q},
               {{1e-5, 2e-5, 3e-5}, {0, 0, 0}, {1.0 / 3, 1, 2}},
               {}}),
      "t_s,q_x,q_y,q_z,q_w,sigma_x_rad,sigma_y_rad,sigma_z_rad\n"
      "0.000,0.000000000000,-0.600000000000,0.000000000000,0.800000000000,1.000000e-05,2.000000e-05,3.000000e-05\n"
      "3.125,0.000000000000,-0.600000000000,0.000000000000,0.800000000000,0.000000e+00,0.000000e+00,0.000000e+00\n"
      "3.125000001,0.000000000000,-0.600000000000,0.000000000000,0.800000000000,3.333333e-01,1.000000e+00,2.000000e+"
      "00\n");
}

TEST_F(AttitudeCsv, MayHaveRates) {
  write_text(directory_ / "a.csv",
             "t_s,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s,q_x,q_y,q_z,q_w,age_s\n1,0.1,-0.2,0.3,0,0,0.6,0.8,5\n");
  const AttitudeMessage message = read_attitude_of_any_format(directory_ / "a.csv", epoch_);
  ASSERT_EQ(message.rate_rad_s.size(), 1U);
  EXPECT_EQ(message.rate_rad_s[0], Eigen::Vector3d(0.1, -0.2, 0.3));
  EXPECT_EQ(message.attitude.age_s, std::vector<double>{5});
  EXPECT_EQ(format_attitude(epoch_, message.attitude, AttitudeDigits::kAll, message.rate_rad_s),
            "t_s,q_x,q_y,q_z,q_w,age_s,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s\n1.000,0,0,0.6,0.8,5.000,0.1,-0.2,0.3\n");
  EXPECT_THAT(refusal_of("t_s,q_x,q_y,q_z,q_w,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s\n1,0,0,0,1,0.1,,0.3\n"),
              HasSubstr("a rate is missing"));
  EXPECT_THAT(refusal_of("t_s,q_x,q_y,q_z,q_w,rate_x_rad_s\n1,0,0,0,1,0.1\n"), HasSubstr("rate_y_rad_s"));
}

TEST_F(AttitudeCsv, ComesBackWithAndWithoutSigmas) {
  AttitudeHistory attitude;
  for (int i = -2; i < 5; ++i) {
    attitude.t.push_back(epoch_ + Duration(i * 1234567891LL));
    attitude.q_in_c.emplace_back(Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d::UnitY()));
    attitude.sigma_rad.emplace_back(1e-5, i == 0 ? std::nan("") : 2e-5, 3e-5);
  }
  AttitudeHistory back = read(written(attitude));
  EXPECT_EQ(back.t, attitude.t);
  ASSERT_EQ(back.sigma_rad.size(), attitude.size());
  EXPECT_TRUE(std::isnan(back.sigma_rad[2].y()));
  EXPECT_EQ(back.sigma_rad[3], attitude.sigma_rad[3]);
  for (std::size_t i = 0; i < attitude.size(); ++i) {
    EXPECT_LE((back.q_in_c[i].coeffs() - attitude.q_in_c[i].coeffs()).cwiseAbs().maxCoeff(), 5.01e-13);
  }
  EXPECT_TRUE(back.age_s.empty());
  attitude.sigma_rad.clear();
  attitude.age_s = {0, 1.5, 3, 4.5, 6, 7.5, 9};
  back = read(written(attitude));
  EXPECT_EQ(back.t, attitude.t);
  EXPECT_TRUE(back.sigma_rad.empty());
  EXPECT_EQ(back.age_s, attitude.age_s);
}

TEST_F(AttitudeCsv, SkipsFurtherColumnsWhateverTheyHold) {
  const AttitudeHistory attitude = read("mode,t_s,q_x,q_y,q_z,q_w,note\nfine,0,0,0,0,1,a b\nok,1,0,0,0,1,\n");
  ASSERT_EQ(attitude.size(), 2U);
  EXPECT_EQ(attitude.t[1] - epoch_, std::chrono::seconds(1));
  EXPECT_EQ(attitude.q_in_c[1].w(), 1);
}

TEST_F(AttitudeCsv, RefusesWhatIsNoCleanSolution) {
  const std::string header = "t_s,q_x,q_y,q_z,q_w\n";
  EXPECT_THAT(refusal_of(header), HasSubstr("a.csv: holds no attitude"));
  EXPECT_THAT(refusal_of(header + "0,0,0,0,1\n0,0,0,0,1\n"), HasSubstr("a.csv:3: the time stamp does not increase"));
  EXPECT_THAT(refusal_of(header + "nan,0,0,0,1\n"), HasSubstr("a.csv:2: t_s is missing"));
  EXPECT_THAT(refusal_of(header + "1e10,0,0,0,1\n"), HasSubstr("a.csv:2: t_s is missing or not below 1e9 s"));
  EXPECT_THAT(refusal_of(header + "0,0,0,,1\n"), HasSubstr("a.csv:2: q is not a unit quaternion"));
  EXPECT_THAT(refusal_of(header + "0,0,0,0.1,1\n"), HasSubstr("a.csv:2: q is not a unit quaternion"));
  EXPECT_THAT(refusal_of(header + "0,0,0,0,1\n1,0,0"), HasSubstr("a.csv:3: the last line is cut short"));
  EXPECT_THAT(refusal_of("t_s,q_x,q_y,q_z\n"), HasSubstr("lacks column \"q_w\""));
  EXPECT_THAT(refusal_of("0,0,0,0,1\n"), HasSubstr("a.csv:1:1: the first line holds numbers"));
  EXPECT_THAT(refusal_of("0,0,0,0,1,1e-5,1e-5,1e-5\n"),
              EndsWith("put this line before it: t_s,q_x,q_y,q_z,q_w,sigma_x_rad,sigma_y_rad,sigma_z_rad"));
  EXPECT_THAT(refusal_of("0,0,0,0,1,1e-5,1e-5,1e-5,3\n"), EndsWith("q_w,sigma_x_rad,sigma_y_rad,sigma_z_rad,age_s"));
  EXPECT_THAT(refusal_of("0,0,0,0,1,1e-5,1e-5\n"), HasSubstr("put a line with the names of its columns before it"));
  EXPECT_THAT(refusal_of("t_s,q_x,q_y,q_z,q_w,sigma_x_rad\n"), HasSubstr("lacks column \"sigma_y_rad\""));
  EXPECT_THAT(refusal_of("t_s,q_x,q_y,q_z,q_w,sigma_x_rad,sigma_y_rad,sigma_z_rad\n0,0,0,0,1,1,-1,1\n"),
              HasSubstr("a.csv:2: a sigma is not positive"));
}

TEST_F(AttitudeCsv, ColumnsOfUnequalLengthAreAProgrammersMistake) {
  EXPECT_THROW(write_attitude(directory_ / "a.csv", epoch_, {{epoch_}, {}, {}, {}}), std::invalid_argument);
}

}  // namespace
}  // namespace trihedron::io
