#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netcdf.h>

#include <Eigen/Geometry>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "fixtures.hpp"
#include "telemetry_map.hpp"
#include "telemetry_table.hpp"
#include "trihedron/io/pass.hpp"
#include "trihedron/io/time_scale.hpp"

namespace trihedron::io {
namespace {

namespace fs = std::filesystem;
using Kind = Defect::Kind;

/// clean_pass() as others have it: everything is different that can be.
constexpr std::string_view kTelemetry = R"([pass]
spacecraft = "TEST"
inertial_frame = "EME2000"

[gyro]
readout_noise_rad = 1e-05
drift_prior_sigma_rad_s = 2e-06
alignment_prior_sigma_rad = 8e-03

[star_tracker]
noise_rad = [1e-05, 2e-05, 9e-05]

[telemetry.time]
scale = "UTC"
format = "iso"

[telemetry.gyro]
file = "gyros.txt"
separator = ";"
header_line = 2
comment = "#"
missing = ["-9999"]
time_column = "Time UTC"
time = {scale = "UTC", format = "s", since = "1970-01-01T00:00:00", leap_seconds = "left-out"}

[[telemetry.gyro.unit]]
direction = ["A3", "-A1", "A2"]
counts_per_unit = 32768
flag = "OK"
good = [1, 3]
[[telemetry.gyro.unit]]
direction = ["B1", "B2", "B3"]
unit = "deg"

[telemetry.star_tracker]
file = "stars.csv"
time_column = "utc"
quaternion = ["s", "x", "y", "z"]
scalar = "first"
maps = "inertial-to-tracker"
flag = "state"
good = [0]
sigma = ["sx", "sy", "sz"]
sigma_unit = "arcsec"
largest_sigma_rad = 1e-3
)";

constexpr double kUnixEpoch_s = 1242777566.0;  // 2009-05-20T00:00:00 TAI: 23:59:26 UTC of the day before

std::string iso_utc(double t_s) {
  TimeText utc(TimeScale::kUtc);
  return utc.format(sample_calibration().epoch + from_seconds(t_s));
}

struct Foreign {
  TemporaryDirectory directory;
  std::string toml{kTelemetry};
  std::string gyros;
  std::string stars;

  Foreign() {
    const RawPass pass = clean_pass();
    gyros = "made by somebody\nTime UTC;A1;A2;A3;OK;\"B1\";B2;B3\n# first row\n";
    const auto angle = [](double cosine) { return std::acos(cosine) * 180 / std::numbers::pi; };
    for (const auto& row : pass.gyro.rows) {
      gyros += fmt::format("{:.3f};{};{};{};1;{};{};{}\n", kUnixEpoch_s + row[0], -32768 * row[2], 32768 * row[3],
                           32768 * row[1], angle(row[4]), angle(row[5]), angle(row[6]));
    }
    stars = "utc,s,x,y,z,state,sx,sy,sz\n";
    for (const auto& row : pass.star_tracker.rows) {
      std::string stamp = iso_utc(row[0]);
      stamp[10] = ' ';
      stars += fmt::format("\"{}Z\",{},{},{},{},0,2,2,20\n", stamp, row[4], -row[1], -row[2], -row[3]);
    }
  }
  [[nodiscard]] fs::path file() const { return directory / "telemetry.toml"; }
  void save() const {
    write_text(file(), toml);
    write_text(directory / "gyros.txt", gyros);
    write_text(directory / "stars.csv", stars);
  }
  [[nodiscard]] LoadedPass load(const Selection& selection = {}) const {
    save();
    return read_pass(file(), selection);
  }
};

LoadedPass clean_loaded() {
  const TemporaryDirectory directory;
  clean_pass().save_directory(directory / "pass");
  return read_pass(directory / "pass");
}

TEST(Telemetry, OfOthersIsTheSamePass) {
  const Foreign foreign;
  LoadedPass loaded = foreign.load();
  EXPECT_TRUE(loaded.defects.empty());
  EXPECT_EQ(loaded.pass.settings.inertial_frame, "EME2000");
  loaded.pass.settings.inertial_frame.clear();
  // Cosines of angles in degrees with 16 digits; stamps of 1.2e9 s, of which a double has 0.2 µs.
  expect_same_pass(loaded.pass, clean_loaded().pass, 1e-12, 1e-15);
  EXPECT_EQ(loaded.sources, (std::vector<fs::path>{foreign.directory / "gyros.txt", foreign.directory / "stars.csv"}));
  EXPECT_FALSE(read_truth(foreign.file()));
  EXPECT_TRUE(is_telemetry_toml(foreign.file()));
  write_text(foreign.directory / "scenario.toml", "[scenario]\n");
  write_text(foreign.directory / "damaged.toml", "[telemetry\n");
  for (const char* const other : {"scenario.toml", "damaged.toml", "gyros.txt", "nowhere.toml"}) {
    EXPECT_FALSE(is_telemetry_toml(foreign.directory / other)) << other;
  }
}

TEST(Telemetry, PeriodsAndEpochThatAreToldGoBeforeTheStamps) {
  Foreign foreign;
  foreign.toml = replaced(foreign.toml, "[gyro]\n", "[gyro]\nperiod_s = 0.6\n");
  foreign.toml = replaced(foreign.toml, "[pass]\n", "[pass]\nepoch_tai = \"2009-05-20T00:00:10\"\nduration_s = 75\n");
  foreign.toml = replaced(foreign.toml, "[star_tracker]\n", "[star_tracker]\nperiod_s = 3.5\n");
  const LoadedPass loaded = foreign.load();
  const PassSettings& settings = loaded.pass.settings;
  EXPECT_EQ(to_seconds(settings.gyro_period), 0.6);
  EXPECT_EQ(to_seconds(settings.star_tracker_period), 3.5);
  EXPECT_EQ(settings.epoch, sample_calibration().epoch + std::chrono::seconds(10));
  EXPECT_EQ(to_seconds(settings.duration), 75);
}

TEST(Telemetry, CorruptStampsDoNotMoveTheEpoch) {
  Foreign foreign;
  foreign.gyros += "1.3e9;0;0;0;1;0;0;0\n";
  const LoadedPass loaded = foreign.load();
  EXPECT_EQ(to_seconds(loaded.pass.settings.duration), 90);
  EXPECT_EQ(only(loaded.defects, Kind::kTimeOutsidePass).first.front().line, 185);
}

TEST(Telemetry, FlagsAndSigmasTakeRowsOutAndAreCounted) {
  Foreign foreign;
  foreign.gyros = replaced(foreign.gyros, ";1;", ";2;");
  foreign.gyros = replaced(foreign.gyros, ";1;", ";3;");
  foreign.stars = replaced(foreign.stars, ",0,2,2,20\n", ",1,900,900,900\n");
  foreign.stars = replaced(foreign.stars, ",0,2,2,20\n", ",0,2,2,900\n");
  foreign.stars = replaced(foreign.stars, ",0,2,2,20\n", ",0,2,2,\n");
  foreign.toml = replaced(foreign.toml, "noise_rad = [1e-05, 2e-05, 9e-05]", "");
  const LoadedPass loaded = foreign.load();
  EXPECT_EQ(loaded.pass.star_tracker.size(), 28U);
  EXPECT_EQ(loaded.pass.gyro.size(), 181U);
  EXPECT_TRUE(loaded.pass.gyro.direction(0, 0).hasNaN());
  EXPECT_FALSE(loaded.pass.gyro.direction(0, 1).hasNaN());
  EXPECT_FALSE(loaded.pass.gyro.direction(1, 0).hasNaN());
  std::vector<std::pair<Kind, std::int64_t>> found;
  for (const Defect& defect : loaded.defects) {
    if (defect.kind == Kind::kFlagged || defect.kind == Kind::kLargeSigma) {
      found.emplace_back(defect.kind, defect.first.front().line);
    }
  }
  EXPECT_EQ(found, (std::vector<std::pair<Kind, std::int64_t>>{
                       {Kind::kFlagged, 4}, {Kind::kFlagged, 2}, {Kind::kLargeSigma, 3}}));
  EXPECT_EQ(only(loaded.defects, Kind::kLargeSigma).count, 2);
  const double arcsec = std::numbers::pi / 648000;
  EXPECT_NEAR(loaded.pass.settings.star_tracker_noise_rad.x(), 2 * arcsec, 1e-18);
  EXPECT_NEAR(loaded.pass.settings.star_tracker_noise_rad.z(), 20 * arcsec, 1e-18);
}

TEST(Telemetry, SigmasMayBeVariances) {
  Foreign foreign;
  foreign.toml = replaced(foreign.toml, "noise_rad = [1e-05, 2e-05, 9e-05]", "");
  foreign.toml = replaced(foreign.toml, "sigma_unit", "sigma_is = \"variance\"\nsigma_unit");
  EXPECT_NEAR(foreign.load().pass.settings.star_tracker_noise_rad.z(), std::sqrt(20.0) * std::numbers::pi / 648000,
              1e-18);
}

TEST(Telemetry, TheSigmasOfAFixAreItsCovariance) {
  Foreign foreign;
  foreign.stars = replaced(foreign.stars, ",0,2,2,20\n", ",0,3,5,40\n");
  const double arcsec = std::numbers::pi / 648000;
  const std::vector<FixCovariance> its = foreign.load().pass.star_tracker.covariances;
  ASSERT_EQ(its.size(), 31U);
  EXPECT_NEAR(its[0].rad2[1], 25 * arcsec * arcsec, 1e-25);
  EXPECT_NEAR(its[0].rad2[2], 1600 * arcsec * arcsec, 1e-23);
  EXPECT_NEAR(its[1].rad2[2], 400 * arcsec * arcsec, 1e-23);
  EXPECT_EQ(its[1].rad2[3], 0);
}

/// Six columns in place of the sigmas.
void take_covariances(Foreign& foreign) {
  foreign.toml = replaced(foreign.toml, "sigma = [\"sx\", \"sy\", \"sz\"]",
                          R"(covariance = ["sx", "sy", "sz", "xy", "-xz", "yz"])");
  foreign.stars = replaced(foreign.stars, ",sx,sy,sz\n", ",sx,sy,sz,xy,xz,yz\n");
  for (int i = 0; i < 31; ++i) {
    foreign.stars = replaced(foreign.stars, ",0,2,2,20\n", ",0,4,9,400,1,6,-2\n");
  }
}

TEST(Telemetry, ACovarianceIsAboutTheAxesOfItsHead) {
  Foreign foreign;
  take_covariances(foreign);
  foreign.toml = replaced(foreign.toml, "noise_rad = [1e-05, 2e-05, 9e-05]", "");
  const double arcsec2 = std::pow(std::numbers::pi / 648000, 2);
  Eigen::Matrix3d expected;
  expected << 4, 1, -6, 1, 9, -2, -6, -2, 400;
  const LoadedPass loaded = foreign.load();
  ASSERT_EQ(loaded.pass.star_tracker.covariances.size(), 31U);
  EXPECT_LT((loaded.pass.star_tracker.covariances[7].matrix() / arcsec2 - expected).norm(), 1e-10);
  EXPECT_NEAR(loaded.pass.settings.star_tracker_noise_rad.y(), 3 * std::sqrt(arcsec2), 1e-18);

  // Of a further head, turned by +90° about z, it is turned into the axes c.
  const std::string table = foreign.toml.substr(foreign.toml.find("file = \"stars.csv\""));
  foreign.toml =
      replaced(foreign.toml, "[star_tracker]\n",
               "[star_tracker]\n[[star_tracker.further]]\nnoise_rad = [1e-5, 1e-5, 1e-5]\n"
               "mounting_rotation_vector_rad = [0, 0, 1.5707963267948966]\nalignment_prior_sigma_rad = 1e-3\n");
  foreign.toml += "\n[[telemetry.further_star_tracker]]\n" + table;
  expected << 9, -1, 2, -1, 4, -6, 2, -6, 400;
  const Pass pass = foreign.load().pass;
  ASSERT_EQ(pass.further_star_trackers.front().covariances.size(), 31U);
  EXPECT_LT((pass.further_star_trackers.front().covariances[7].matrix() / arcsec2 - expected).norm(), 1e-10);
}

TEST(Telemetry, FixesAreLeftOutByTheirCovarianceAsBySigmas) {
  Foreign foreign;
  take_covariances(foreign);
  foreign.stars = replaced(foreign.stars, ",0,4,9,400,1,6,-2\n", ",0,4,9,1e6,1,6,-2\n");
  foreign.stars = replaced(foreign.stars, ",0,4,9,400,1,6,-2\n", ",0,4,9,400,7,6,-2\n");  // x and y correlated by 1.2
  const LoadedPass loaded = foreign.load();
  EXPECT_EQ(only(loaded.defects, Kind::kLargeSigma).first.front().line, 2);
  EXPECT_EQ(only(loaded.defects, Kind::kNoCovariance).first.front().line, 3);
  EXPECT_FALSE(loaded.pass.star_tracker.covariances.front().is_told());
}

TEST(Telemetry, MissingValuesAndACutLineAreCounted) {
  Foreign foreign;
  foreign.gyros = replaced(foreign.gyros, "32768;1;", "-9999;1;");
  foreign.gyros = replaced(foreign.gyros, "1242777570.000;", ";");
  foreign.gyros += "1242777700.000;0;0";
  const LoadedPass loaded = foreign.load();
  EXPECT_EQ(only(loaded.defects, Kind::kMissingValue).first.front().line, 4);
  EXPECT_EQ(only(loaded.defects, Kind::kMissingTime).first.front().line, 12);
  EXPECT_EQ(only(loaded.defects, Kind::kTruncatedLine).first.front().line, 185);
  foreign.gyros += ";0;1;90;90;-";
  EXPECT_EQ(only(foreign.load().defects, Kind::kTruncatedLine).first.front().line, 185);
}

TEST(Telemetry, RangeAndIntervalsAreLeftOutAndCounted) {
  Foreign foreign;
  write_text(foreign.directory / "slews.csv", fmt::format("begin,what,end\n{},roll,{}\n", iso_utc(30), iso_utc(36)));
  foreign.toml += R"(
[[telemetry.exclude]]
file = "slews.csv"
begin_column = "begin"
end_column = "end"
of = "star-trackers"
)";
  const Time epoch = sample_calibration().epoch;
  Selection selection;
  selection.from = epoch + std::chrono::seconds(6);
  selection.to = epoch + std::chrono::seconds(81);
  selection.exclude.push_back({epoch + std::chrono::seconds(50), epoch + std::chrono::seconds(52), true, false});
  const LoadedPass loaded = foreign.load(selection);
  EXPECT_EQ(loaded.pass.settings.epoch, *selection.from);
  EXPECT_EQ(to_seconds(loaded.pass.settings.duration), 75);
  EXPECT_EQ(loaded.pass.gyro.t.front(), *selection.from);
  EXPECT_EQ(loaded.pass.gyro.t.back(), *selection.to);
  EXPECT_EQ(loaded.pass.gyro.size(), 151U - 4U);
  EXPECT_EQ(loaded.pass.star_tracker.size(), 26U - 2U);
  std::int64_t outside = 0;
  std::int64_t excluded = 0;
  for (const Defect& defect : loaded.defects) {
    outside += defect.kind == Kind::kOutsideRange ? defect.count : 0;
    excluded += defect.kind == Kind::kExcluded ? defect.count : 0;
  }
  EXPECT_EQ(outside, 12 + 18 + 2 + 3);
  EXPECT_EQ(excluded, 4 + 2);
  EXPECT_EQ(loaded.pass.star_tracker.t[8], epoch + std::chrono::seconds(36));
  EXPECT_EQ(loaded.sources.front(), foreign.directory / "slews.csv");
  // The same range of the file itself.
  foreign.toml =
      replaced(foreign.toml, "[telemetry.time]",
               fmt::format("[telemetry]\nfrom = \"{}\"\nto = \"{}\"\n[telemetry.time]", iso_utc(6), iso_utc(81)));
  EXPECT_EQ(foreign.load().pass.settings.duration, loaded.pass.settings.duration);
}

TEST(Telemetry, PlacesOfDefectsCountFromTheEpochOfThePart) {
  Foreign foreign;
  const std::size_t row = foreign.gyros.find("1242777576.000;");  // 10 s after the epoch
  foreign.gyros.replace(foreign.gyros.find(";1;", row), 3, ";2;");
  Selection selection;
  selection.from = sample_calibration().epoch + std::chrono::seconds(6);
  const LoadedPass loaded = foreign.load(selection);
  // The first is found before the pass is cut, the second after it.
  EXPECT_EQ(only(loaded.defects, Kind::kFlagged).first.front().t_s, 4);
  EXPECT_EQ(only(loaded.defects, Kind::kMissingValue).first.front().t_s, 4);
  const auto outside = std::ranges::find(loaded.defects, Kind::kOutsideRange, &Defect::kind);
  ASSERT_NE(outside, loaded.defects.end());
  EXPECT_EQ(outside->first.front().t_s, -6);
}

TEST(Telemetry, APartOfAnyPassIsAPass) {
  const TemporaryDirectory directory;
  clean_pass().save_directory(directory / "pass");
  Selection selection;
  selection.from = sample_calibration().epoch + std::chrono::seconds(12);
  const LoadedPass part = read_pass(directory / "pass", selection);
  EXPECT_EQ(part.pass.star_tracker.size(), 27U);
  EXPECT_EQ(part.pass.settings.epoch, *selection.from);
  EXPECT_EQ(to_seconds(part.pass.settings.duration), 78);
}

TEST(Telemetry, MountingInTheBodyGivesTheAlignment) {
  Foreign foreign;
  foreign.toml = replaced(foreign.toml, "[star_tracker]\n",
                          "[[gyro.unit]]\nmounting_rotation_vector_rad = [0, 0, 0.5]\n[[gyro.unit]]\n"
                          "mounting_rotation_vector_rad = [0.3, 0, 0]\n[star_tracker]\n"
                          "mounting_rotation_vector_rad = [0, 0, 0.2]\n");
  const LoadedPass loaded = foreign.load();
  const PassSettings& settings = loaded.pass.settings;
  EXPECT_NEAR((settings.gyros[0].alignment_rotation_vector_rad - Eigen::Vector3d(0, 0, 0.3)).norm(), 0, 1e-15);
  const Eigen::Quaterniond c_b = Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitZ()) *
                                 Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  const Eigen::Vector3d found = settings.gyros[1].alignment_rotation_vector_rad;
  EXPECT_LT(Eigen::Quaterniond(Eigen::AngleAxisd(found.norm(), found.normalized())).angularDistance(c_b), 1e-15);
  // It is written and read back.
  write_pass(foreign.directory / "again", loaded.pass, nullptr);
  const PassSettings again = read_pass(foreign.directory / "again").pass.settings;
  EXPECT_EQ(again.star_tracker_mounting_rotation_vector_rad, settings.star_tracker_mounting_rotation_vector_rad);
  EXPECT_EQ(again.gyros[1].alignment_rotation_vector_rad, found);
  EXPECT_EQ(again.inertial_frame, "EME2000");
}

// ---- Stamps

struct StampCase {
  std::string_view time;   ///< keys
  std::string_view stamp;  ///< of 2009-05-20T00:00:00 TAI

  friend void PrintTo(const StampCase& one, std::ostream* out) { *out << one.stamp; }
};

class StampsOfTelemetry : public testing::TestWithParam<StampCase> {};

TEST_P(StampsOfTelemetry, AreTheInstant) {
  const std::string toml =
      replaced(std::string(kTelemetry),
               R"(time = {scale = "UTC", format = "s", since = "1970-01-01T00:00:00", leap_seconds = "left-out"})",
               fmt::format("time = {{{}}}", GetParam().time));
  const Stamps stamps = parse_telemetry_toml(toml, "telemetry.toml", "").map.gyro.stamps;
  StampReader reader(stamps);
  TimeText::Fault fault;
  const std::string stamp(GetParam().stamp);
  const std::optional<Time> read = stamps.format == Stamps::Format::kIso
                                       ? reader.of_text(stamp, fault)
                                       : std::optional(reader.of_number(std::stod(stamp)));
  ASSERT_TRUE(read) << fault.reason;
  // A double has 40 µs of a Julian date, less than 1 µs of the others.
  EXPECT_NEAR(to_seconds(*read - sample_calibration().epoch), 0, stamps.format == Stamps::Format::kJd ? 5e-5 : 1e-6);
}

TEST(Telemetry, NumbersThatStandForNoTimeHaveNone) {
  StampReader utc(Stamps{TimeScale::kUtc, Stamps::Format::kNumber, 1, Time{}, false});
  EXPECT_EQ(utc.of_number(0), kNoTime);  // 1958: no leap seconds are known
  EXPECT_EQ(utc.of_number(kNaN), kNoTime);
  EXPECT_EQ(utc.of_number(1e300), kNoTime);
}

INSTANTIATE_TEST_SUITE_P(
    All, StampsOfTelemetry,
    testing::Values(
        StampCase{R"(scale = "TAI", format = "iso")", "2009-05-20T00:00:00"},
        StampCase{R"(scale = "UTC", format = "iso")", "2009-139T23:59:26Z"},
        StampCase{R"(scale = "GPS", format = "s", since = "1980-01-06T00:00:00")", "926812781"},
        StampCase{R"(scale = "GPS", format = "h", since = "2009-05-19T22:59:41")", "1"},
        StampCase{R"(scale = "TAI", format = "ms", since = "1958-01-01T00:00:00")", "1621468800000"},
        StampCase{R"(scale = "TT", format = "s", since = "2000-01-01T12:00:00")", "296049632.184"},
        StampCase{R"(scale = "UTC", format = "us", since = "1970-01-01T00:00:00", leap_seconds = "left-out")",
                  "1242777566000000"},
        StampCase{R"(scale = "UTC", format = "ns", since = "2009-01-01T00:00:00", leap_seconds = "counted")",
                  "12009566000000000"},
        StampCase{R"(scale = "UTC", format = "s", since = "2008-12-31T00:00:00", leap_seconds = "counted")",
                  "12095967"},
        StampCase{R"(scale = "TAI", format = "mjd")", "54971"},
        StampCase{R"(scale = "UTC", format = "jd")", "2454971.4996064813"},
        StampCase{R"(scale = "TAI", format = "min", since = "2009-05-19T23:00:00")", "60"},
        StampCase{R"(scale = "TAI", format = "days", since = "2009-05-19T00:00:00")", "1"}));

// ---- NetCDF

void save_netcdf(const fs::path& file) {
  const RawPass pass = clean_pass();
  const auto check = [](int status) { ASSERT_EQ(status, NC_NOERR) << nc_strerror(status); };
  int id = 0;
  int group = 0;
  std::array<int, 2> dimensions{};
  int variable = 0;
  check(nc_create(file.c_str(), NC_NETCDF4 | NC_CLOBBER, &id));
  check(nc_def_grp(id, "acs", &group));
  const std::size_t rows = pass.star_tracker.rows.size();
  check(nc_def_dim(group, "time", rows, dimensions.data()));
  check(nc_def_dim(group, "component", 4, &dimensions[1]));
  std::vector<double> values;
  std::vector<std::int64_t> stamps;
  for (const auto& row : pass.star_tracker.rows) {
    stamps.push_back(static_cast<std::int64_t>(std::llround(1e3 * row[0])));
    values.insert(values.end(), row.begin() + 1, row.end());
  }
  check(nc_def_var(group, "q", NC_DOUBLE, 2, dimensions.data(), &variable));
  check(nc_put_var_double(group, variable, values.data()));
  check(nc_def_var(group, "stamp", NC_INT64, 1, dimensions.data(), &variable));
  check(nc_put_var_longlong(group, variable, reinterpret_cast<const long long*>(stamps.data())));
  check(nc_def_var(group, "text", NC_CHAR, 1, dimensions.data(), &variable));
  int other = 0;
  check(nc_def_dim(group, "other", 3, &other));
  check(nc_def_var(group, "short", NC_DOUBLE, 1, &other, &variable));
  check(nc_close(id));
}

constexpr std::string_view kStars = R"([telemetry.star_tracker]
file = "stars.nc"
time_column = "acs/stamp"
time = {scale = "TAI", format = "ms", since = "2009-05-20T00:00:00"}
quaternion = ["acs/q[0]", "acs/q[1]", "acs/q[2]", "acs/q[3]"]
scalar = "last"
maps = "tracker-to-inertial"
)";

std::string of_netcdf(const std::string& toml) {
  return toml.substr(0, toml.find("[telemetry.star_tracker]")) + std::string(kStars);
}

TEST(Telemetry, OfNetcdfIsTheSamePass) {
  Foreign foreign;
  save_netcdf(foreign.directory / "stars.nc");
  foreign.toml = of_netcdf(foreign.toml);
  LoadedPass loaded = foreign.load();
  EXPECT_TRUE(loaded.defects.empty());
  loaded.pass.settings.inertial_frame.clear();
  expect_same_pass(loaded.pass, clean_loaded().pass, 1e-12, 1e-15);
}

// ---- Refusals

struct Spoilt {
  std::string_view from;
  std::string_view to;
  std::string_view words;  ///< of the message

  friend void PrintTo(const Spoilt& spoilt, std::ostream* out) { *out << spoilt.words; }
};

class RefusedTelemetry : public testing::TestWithParam<Spoilt> {};

TEST_P(RefusedTelemetry, NamesThePlace) {
  Foreign foreign;
  foreign.toml = replaced(foreign.toml, GetParam().from, GetParam().to);
  const std::string message = refusal([&] { static_cast<void>(foreign.load()); });
  EXPECT_NE(message.find(GetParam().words), std::string::npos) << message;
  EXPECT_NE(message.find("; "), std::string::npos) << "no cure: " << message;
}

INSTANTIATE_TEST_SUITE_P(
    Keys, RefusedTelemetry,
    testing::Values(
        Spoilt{"EME2000", "TEME", "telemetry.toml:3:18: \"inertial_frame\" is \"TEME\""},
        Spoilt{"noise_rad = [1e-05, 2e-05, 9e-05]\n\n[telemetry.time]", "\n[telemetry.time]\nfrom = 1",
               "not known in time"},
        Spoilt{"[telemetry.time]", "[telemetry.tiem]", "did you mean"},
        Spoilt{"scale = \"UTC\"\nformat", "scale = \"Moscow\"\nformat", "\"scale\" cannot be \"Moscow\""},
        Spoilt{"format = \"iso\"", "format = \"text\"", "\"format\" cannot be \"text\""},
        Spoilt{"format = \"iso\"", "format = \"iso\"\nsince = \"2009-05-20T00:00:00\"", "format is not a number"},
        Spoilt{"format = \"iso\"", "format = \"s\"", "since when they count"},
        Spoilt{"format = \"iso\"", "format = \"s\"\nsince = \"noon\"", "not an ISO date and time"},
        Spoilt{"format = \"iso\"", "format = \"mjd\"\nleap_seconds = \"counted\"", "only numbers in UTC"},
        Spoilt{", leap_seconds = \"left-out\"", "", "whether they count leap seconds"},
        Spoilt{"leap_seconds = \"left-out\"", "leap_seconds = \"counted\"", "for which leap seconds are not known"},
        Spoilt{"leap_seconds = \"left-out\"", "leap_seconds = \"perhaps\"", "\"leap_seconds\" cannot be \"perhaps\""},
        Spoilt{"separator = \";\"", "separator = \";;\"", "not a character that separates"},
        Spoilt{"separator = \";\"", "separator = \".\"", "not a character that separates"},
        Spoilt{"separator = \";\"", "separator = \",\"",
               "gyros.txt:2:9: lacks column \"Time UTC\": the line is a single field; give separator = \";\""},
        Spoilt{"header_line = 2", "header_line = -1", "header_line"},
        Spoilt{"header_line = 2", "header_line = 1.5", "not a whole number"},
        Spoilt{"header_line = 2", "header_line = 1", "gyros.txt:1"},
        Spoilt{"header_line = 2", "header_line = 999", "has 184 lines"},
        Spoilt{"comment = \"#\"", "", "the line has 1 field, the header 8"},
        Spoilt{"missing = [\"-9999\"]", "missing = \"-9999\"", "no list"},
        Spoilt{"missing = [\"-9999\"]", "missing = [-9999]", "missing"},
        Spoilt{"time_column = \"Time UTC\"", "", "key \"time_column\" is missing"},
        Spoilt{"time_column = \"Time UTC\"", "time_column = \"\"", "\"time_column\" is empty"},
        Spoilt{"time_column = \"Time UTC\"", "time_column = \"Time utc\"", "did you mean \"Time UTC\""},
        Spoilt{"[\"A3\", \"-A1\", \"A2\"]", "[\"A3\", \"-A1\"]", "not a list of 3 names"},
        Spoilt{"[\"A3\", \"-A1\", \"A2\"]", "[\"A3\", \"-A3\", \"A2\"]", "has \"A3\" twice"},
        Spoilt{"[\"A3\", \"-A1\", \"A2\"]", "[\"A3\", \"-\", \"A2\"]", "a name that is empty"},
        Spoilt{"[\"B1\", \"B2\", \"B3\"]", "[\"B1\", \"-A1\", \"B3\"]",
               "column \"A1\" is that of gyro 1 and of gyro 2"},
        Spoilt{"[\"A3\", \"-A1\", \"A2\"]", "[\"A3\", \"-A1\", \"A9\"]", "gyros.txt:2: lacks column \"A9\""},
        Spoilt{"counts_per_unit = 32768", "counts_per_unit = 0", "counts_per_unit"},
        Spoilt{"good = [1, 3]", "", "belong together"}, Spoilt{"good = [1, 3]", "good = 1", "no list"},
        Spoilt{"unit = \"deg\"", "unit = \"grad\"", "\"unit\" cannot be \"grad\""},
        Spoilt{"[[telemetry.gyro.unit]]\ndirection = [\"B1\", \"B2\", \"B3\"]\nunit = \"deg\"", "", "is there 1 times"},
        Spoilt{"[\"s\", \"x\", \"y\", \"z\"]", "[\"x\", \"y\", \"z\"]", "not a list of 4 names"},
        Spoilt{"scalar = \"first\"", "", "key \"scalar\" is missing"},
        Spoilt{"scalar = \"first\"", "scalar = \"middle\"", "\"scalar\" cannot be \"middle\""},
        Spoilt{"maps = \"inertial-to-tracker\"", "", "key \"maps\" is missing"},
        Spoilt{"maps = \"inertial-to-tracker\"", "maps = \"J2000\"", "\"maps\" cannot be \"J2000\""},
        Spoilt{"sigma_unit = \"arcsec\"", "", "belong together"},
        Spoilt{"sigma = [\"sx\", \"sy\", \"sz\"]\nsigma_unit = \"arcsec\"", "", "is there without \"sigma\""},
        Spoilt{"sigma = ", "covariance = [\"1\", \"2\", \"3\", \"4\", \"5\", \"6\"]\nsigma = ", "are both there"},
        Spoilt{"sigma = [", "covariance = [", "is not a list of 6 names"},
        Spoilt{"sigma = [\"sx\", \"sy\", \"sz\"]\nsigma_unit = \"arcsec\"\n", "sigma_is = \"variance\"\n",
               "\"sigma_is\" is there without"},
        Spoilt{"\"gyros.txt\"", "\"gyros.parquet\"",
               "gyros.parquet: is Parquet, for which this program has no library"},
        Spoilt{"largest_sigma_rad = 1e-3", "largest_sigma_rad = 10", "largest_sigma_rad"},
        Spoilt{"stars.csv", "nowhere.csv", "nowhere.csv"}, Spoilt{"stars.csv", "stars.nc", "stars.nc"},
        Spoilt{"[star_tracker]\n",
               "[star_tracker]\n[[star_tracker.further]]\nnoise_rad = [1e-5, 1e-5, 1e-5]\nmounting_rotation_vector_rad "
               "= [0, 1, 0]\nalignment_prior_sigma_rad = 1e-3\n[star_tracker2]\n",
               "star_tracker2"},
        Spoilt{"[star_tracker]\n",
               "[[gyro.unit]]\nmounting_rotation_vector_rad = [0, 0, 1]\n[[gyro.unit]]\n[star_tracker]\n",
               "and [star_tracker] has none"},
        Spoilt{"[star_tracker]\n",
               "[[gyro.unit]]\nmounting_rotation_vector_rad = [0, 0, 1]\nalignment_prior_rotation_vector_rad = [0, 0, "
               "0]\n[[gyro.unit]]\n[star_tracker]\n",
               "each gives the alignment"},
        Spoilt{"readout_noise_rad = 1e-05\n", "", "key \"readout_noise_rad\" is missing"}));

struct SpoiltText {
  bool of_gyros;
  std::string_view from;
  std::string_view to;
  std::string_view words;

  friend void PrintTo(const SpoiltText& spoilt, std::ostream* out) { *out << spoilt.words; }
};

class RefusedTables : public testing::TestWithParam<SpoiltText> {};

TEST_P(RefusedTables, NameThePlace) {
  Foreign foreign;
  std::string& text = GetParam().of_gyros ? foreign.gyros : foreign.stars;
  text = replaced(text, GetParam().from, GetParam().to);
  const std::string message = refusal([&] { static_cast<void>(foreign.load()); });
  EXPECT_NE(message.find(GetParam().words), std::string::npos) << message;
}

INSTANTIATE_TEST_SUITE_P(
    Text, RefusedTables,
    testing::Values(
        SpoiltText{true, "\n1242777567.000;", "\n1242777567,000;",
                   "gyros.txt:6:1: \"1242777567,000\" of column \"Time UTC\" is not a number; write numbers "
                   "with decimal points"},
        SpoiltText{true, ";32768;", ";0x8000;", "of column \"A3\" is not a number"},
        SpoiltText{true, ";A2;", ";A1;", "gyros.txt:2:13: column \"A1\" is there twice"},
        SpoiltText{true, ";1;", ";1;7;", "gyros.txt:4:1: the line has 9 fields, the header 8"},
        SpoiltText{false, "23:59:29Z", "23:59:79Z", "stars.csv:3:2: column \"utc\": "},
        SpoiltText{false, "23:59:29Z", "23:59:29+03", "stars.csv:3:2: column \"utc\": "},
        SpoiltText{false, "utc,s,", "utc,scalar,", "stars.csv:1: lacks column \"s\""}));

TEST(Telemetry, FlagsThatAreNeverGoodAreRefusedWithTheValuesThatAreThere) {
  Foreign foreign;
  foreign.toml = replaced(foreign.toml, "good = [1, 3]", "good = [0, 3]");
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); })
                .find("telemetry.toml: flag \"OK\" of gyro 1 is in no row of gyros.txt a value of good = [0, 3]; give "
                      "the values that are good: there are 1"),
            std::string::npos);
  foreign.toml = replaced(foreign.toml, "good = [0, 3]", "good = [1]");
  foreign.toml = replaced(foreign.toml, "good = [0]", "good = [7]");
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("\"state\" of the star tracker"),
            std::string::npos);
  while (foreign.stars.find(",0,2,2,20") != std::string::npos) {
    foreign.stars = replaced(foreign.stars, ",0,2,2,20", ",,2,2,20");
  }
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("this one has no numbers"), std::string::npos);
}

TEST(Telemetry, ThatIsAnotherFileIsRefusedForWhatItIs) {
  Foreign foreign;
  foreign.toml = "[scenario]\nseed = 1\n";
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("telemetry.toml: is a scenario, not a pass; make"),
            std::string::npos);
  foreign.toml = "[pass]\nspacecraft = \"TEST\"\n";
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("give the directory in which it stands"),
            std::string::npos);
  foreign.toml = "drift_model = \"esg7\"\n";
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("has no table [telemetry]; give a pass: "),
            std::string::npos);
}

TEST(Telemetry, TextsThatAreNoneAreRefused) {
  Foreign foreign;
  const std::string gyros = foreign.gyros;
  foreign.gyros = " \r\n";
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("gyros.txt: is empty; "), std::string::npos);
  for (const char* const mark : {"\xFF\xFE", "\xFE\xFF"}) {
    foreign.gyros = mark + gyros;
    EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("gyros.txt:1:1: is UTF-16"), std::string::npos);
  }
  foreign.gyros = gyros;
  foreign.toml.insert(1, 1, '\0');
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("telemetry.toml:1:1: is UTF-16"),
            std::string::npos);
}

TEST(Telemetry, WithoutAnySigmaOrNoiseIsRefused) {
  Foreign foreign;
  foreign.toml = replaced(foreign.toml, "noise_rad = [1e-05, 2e-05, 9e-05]", "");
  foreign.toml = foreign.toml.substr(0, foreign.toml.find("sigma = "));
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("\"noise_rad\" is missing"), std::string::npos);
}

TEST(Telemetry, SigmasThatAreNoneAreRefused) {
  Foreign foreign;
  foreign.toml = replaced(foreign.toml, "noise_rad = [1e-05, 2e-05, 9e-05]", "");
  foreign.toml = replaced(foreign.toml, "largest_sigma_rad = 1e-3", "");
  foreign.toml = replaced(foreign.toml, "\"arcsec\"", "\"deg\"");
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("no noise of a star tracker"), std::string::npos);
  foreign.toml = replaced(foreign.toml, "sigma_unit", "largest_sigma_rad = 1e-9\nsigma_unit");
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("not one fix has"), std::string::npos);
}

TEST(Telemetry, StampsThatCannotShowThePassAreRefused) {
  Foreign foreign;
  std::string other_year = foreign.gyros;
  foreign.gyros = replaced(foreign.gyros, "\n12427775", "\n11");
  for (int i = 0; i < 20; ++i) {
    foreign.gyros = replaced(foreign.gyros, "\n12427775", "\n10427775");
  }
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("lie days apart"), std::string::npos);
  foreign.gyros = other_year;
  foreign.toml = replaced(foreign.toml, "since = \"1970-01-01T00:00:00\"", "since = \"1980-01-06T00:00:00\"");
  // Stamps of UTC ten years later; the fixes are those of 2009.
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("no fix at all"), std::string::npos);
  foreign.toml = replaced(foreign.toml, "since = \"1980-01-06T00:00:00\"", "since = \"2199-01-01T00:00:00\"");
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load()); }).find("not one value of column \"Time UTC\" is a time"),
            std::string::npos);
}

std::string message_of(const Foreign& foreign) {
  return refusal([&] { static_cast<void>(foreign.load()); });
}

TEST(Telemetry, UnitsThatAreMistakenAreProposed) {
  Foreign counts;
  counts.toml = replaced(counts.toml, "counts_per_unit = 32768\n", "");
  EXPECT_NE(message_of(counts).find("counts_per_unit = 32768"), std::string::npos) << message_of(counts);
  Foreign angles;
  angles.toml = replaced(angles.toml, "unit = \"deg\"\n", "");
  EXPECT_NE(message_of(angles).find("unit = \"deg\""), std::string::npos) << message_of(angles);
  Foreign quaternions;
  quaternions.toml = replaced(quaternions.toml, "scalar =", "counts_per_unit = 0.001\nscalar =");
  EXPECT_NE(message_of(quaternions).find("counts_per_unit = 1000"), std::string::npos) << message_of(quaternions);
  Foreign milliseconds;
  milliseconds.toml = replaced(milliseconds.toml, "format = \"s\", since = \"1970-01-01T00:00:00\"",
                               "format = \"days\", since = \"1970-01-01T00:00:00\"");
  EXPECT_NE(message_of(milliseconds).find("not one value of column"), std::string::npos) << message_of(milliseconds);
}

TEST(Telemetry, StampsInMillisecondsAreProposed) {
  Foreign foreign;
  std::string gyros = "made by somebody\nTime UTC;A1;A2;A3;OK;B1;B2;B3\n";
  for (int i = 0; i <= 180; ++i) {
    gyros += fmt::format("{};0;0;32768;1;90;0;90\n", 500 * i);
  }
  foreign.gyros = gyros;
  foreign.toml = replaced(
      foreign.toml, R"(time = {scale = "UTC", format = "s", since = "1970-01-01T00:00:00", leap_seconds = "left-out"})",
      R"(time = {scale = "TAI", format = "s", since = "2009-05-20T00:00:00"})");
  EXPECT_NE(message_of(foreign).find("format = \"ms\""), std::string::npos) << message_of(foreign);
}

TEST(Telemetry, ColumnsExchangedBetweenGyrosAreProposed) {
  const TemporaryDirectory directory;
  RawPass pass = clean_pass();
  for (auto& row : pass.gyro.rows) {
    row[1] = 0.8;
    row[2] = 0.6 * std::sin(1e-3 * row[0]);
    row[3] = 0.6 * std::cos(1e-3 * row[0]);
    row[4] = 0.2;
    row[5] = 0.3;
    row[6] = std::sqrt(1 - 0.04 - 0.09);
  }
  pass.save_directory(directory / "right");
  EXPECT_EQ(refusal([&] { static_cast<void>(read_pass(directory / "right")); }), "");
  for (auto& row : pass.gyro.rows) {
    std::swap(row[1], row[5]);
  }
  pass.save_directory(directory / "pass");
  const std::string message = refusal([&] { static_cast<void>(read_pass(directory / "pass")); });
  EXPECT_NE(message.find("columns h1_x and h2_y look exchanged"), std::string::npos) << message;
}

TEST(Telemetry, AWrongRangeIsRefused) {
  Foreign foreign;
  Selection selection;
  selection.from = sample_calibration().epoch + std::chrono::seconds(31);
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load(selection)); }).find("less than a minute of the pass"),
            std::string::npos);
  selection.to = *selection.from - std::chrono::seconds(1);
  EXPECT_NE(refusal([&] { static_cast<void>(foreign.load(selection)); }).find("before it begins"), std::string::npos);
}

TEST(Telemetry, WrongIntervalsAreRefused) {
  const TemporaryDirectory directory;
  const auto message = [&](std::string_view text) {
    write_text(directory / "i.csv", text);
    return refusal([&] { static_cast<void>(read_intervals(directory / "i.csv", TimeScale::kTai)); });
  };
  EXPECT_EQ(message("begin,end\n2009-05-20T00:00:00,2009-05-20T00:01:00\n"), "");
  EXPECT_NE(message("begin,end\n\n2009-05-20T00:00:00,2009-05-20T00:00:00\n").find("i.csv:3: interval 1 does not end"),
            std::string::npos);
  EXPECT_NE(message("begin,end\n2009-05-20T00:00:00,\n").find("does not end"), std::string::npos);
  EXPECT_NE(message("begin,end\n2009-05-20T00:00:00").find("i.csv:2: the last line is cut short"), std::string::npos);
  EXPECT_NE(message("start,stop\n").find("lacks column \"begin\""), std::string::npos);
}

TEST(Telemetry, WhatNetcdfDoesNotHoldIsRefused) {
  Foreign foreign;
  save_netcdf(foreign.directory / "stars.nc");
  const auto message = [&](std::string_view from, std::string_view to) {
    Foreign& its = foreign;
    its.toml = replaced(of_netcdf(std::string(kTelemetry)), from, to);
    return refusal([&] { static_cast<void>(its.load()); });
  };
  EXPECT_NE(message("acs/q[0]", "acs/q[4]").find("has no such column; it has 4"), std::string::npos);
  EXPECT_NE(message("acs/q[0]", "acs/q[x]").find("has no such column"), std::string::npos);
  EXPECT_NE(message("acs/q[0]", "acs/q").find("has 2 dimensions, not 1"), std::string::npos);
  EXPECT_NE(message("acs/stamp", "acs/stamp[0]").find("has 1 dimension, not 2"), std::string::npos);
  EXPECT_NE(message("acs/q[0]", "acs/p[0]").find("lacks variable \"acs/p[0]\""), std::string::npos);
  EXPECT_NE(message("acs/q[0]", "gnc/q[0]").find("lacks group \"gnc\""), std::string::npos);
  EXPECT_NE(message("acs/q[0]", "acs/text").find("does not hold numbers"), std::string::npos);
  EXPECT_NE(message("acs/q[0]", "acs/short").find("has 3 rows"), std::string::npos);
  EXPECT_NE(
      message("format = \"ms\", since = \"2009-05-20T00:00:00\"", "format = \"iso\"").find("where stamps are numbers"),
      std::string::npos);
}

}  // namespace
}  // namespace trihedron::io
