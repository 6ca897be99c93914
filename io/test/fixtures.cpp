#include "fixtures.hpp"

#include <fmt/format.h>
#include <netcdf.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "trihedron/core/drift.hpp"
#include "trihedron/io/time_scale.hpp"

namespace trihedron::io {
namespace fs = std::filesystem;
namespace {

void require(int status) {
  if (status != NC_NOERR) {
    throw std::runtime_error(nc_strerror(status));
  }
}

void put_group(int file, const char* name, const char* dimension_name, const RawTable& table) {
  int group = 0;
  int dimension = 0;
  require(nc_def_grp(file, name, &group));
  require(nc_def_dim(group, dimension_name, table.rows.size(), &dimension));
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    int variable = 0;
    std::vector<double> column;
    std::ranges::transform(table.rows, std::back_inserter(column), [&](const auto& row) { return row[i]; });
    require(nc_def_var(group, table.columns[i].c_str(), NC_DOUBLE, 1, &dimension, &variable));
    require(nc_put_var_double(group, variable, column.data()));
  }
}

}  // namespace

TemporaryDirectory::TemporaryDirectory() {
  std::string name = (fs::temp_directory_path() / "trihedron-io-XXXXXX").string();
  path_ = ::mkdtemp(name.data());
}

TemporaryDirectory::~TemporaryDirectory() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::vector<std::string> TemporaryDirectory::names() const {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(path_)) {
    names.push_back(entry.path().filename().string());
  }
  std::ranges::sort(names);
  return names;
}

void write_text(const fs::path& file, std::string_view text) {
  std::ofstream(file, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
}

std::string read_text(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(text).str();
}

std::string RawTable::csv() const {
  std::string text = fmt::format("{}\n", fmt::join(columns, ","));
  for (const auto& row : rows) {
    text += fmt::format("{}\n", fmt::join(row, ","));
  }
  return text;
}

void RawPass::save_directory(const fs::path& directory) const {
  fs::create_directories(directory);
  write_text(directory / "pass.toml", toml);
  write_text(directory / "gyro.csv", gyro.csv());
  write_text(directory / "star_tracker.csv", star_tracker.csv());
}

void RawPass::save_netcdf(const fs::path& file, const char* dimension) const {
  int id = 0;
  require(nc_create(file.c_str(), NC_NETCDF4 | NC_CLOBBER, &id));
  require(nc_put_att_text(id, NC_GLOBAL, "pass_toml", toml.size(), toml.c_str()));
  put_group(id, "gyro", dimension, gyro);
  put_group(id, "star_tracker", dimension, star_tracker);
  require(nc_close(id));
}

RawPass clean_pass() {
  RawPass pass;
  pass.toml = R"([pass]
spacecraft = "TEST"
epoch_tai = "2009-05-20T00:00:00"
duration_s = 90

[gyro]
period_s = 0.5
readout_noise_rad = 1e-05
drift_prior_sigma_rad_s = 2e-06
alignment_prior_sigma_rad = 8e-03

[star_tracker]
period_s = 3
noise_rad = [1e-05, 2e-05, 9e-05]
)";
  pass.gyro.columns = {"t_s", "h1_x", "h1_y", "h1_z", "h2_x", "h2_y", "h2_z"};
  for (int i = 0; i <= 180; ++i) {
    const double t = 0.5 * i;
    const double c = std::cos(1e-3 * t);
    const double s = std::sin(1e-3 * t);
    pass.gyro.rows.push_back({t, c, s, 0, 0, c, s});
  }
  pass.star_tracker.columns = {"t_s", "q_x", "q_y", "q_z", "q_w"};
  for (int i = 0; i <= 30; ++i) {
    const double t = 3.0 * i;
    pass.star_tracker.rows.push_back({t, 0, 0, std::sin(5e-4 * t), std::cos(5e-4 * t)});
  }
  return pass;
}

Truth clean_truth() {
  Truth truth;
  for (int gyro = 0; gyro < 2; ++gyro) {
    Truth::Gyro parameters;
    for (int i = 0; i < Esg7::kSize; ++i) {
      parameters.drift_rad_s.emplace_back(DriftCoefficient::of_eq1(i), 1e-7 / 3 * (i + 1 + 10 * gyro));
    }
    parameters.unmodelled_rad_s = {{"w20", 1e-9 / 7}, {"w21", -1e-8}};
    parameters.alignment_rotation_vector_rad = {1e-3, -2e-3, 1e-3 / 3};
    truth.gyros.push_back(parameters);
  }
  truth.orbital_rate_rad_s = 1e-3 / 3;
  truth.star_trackers = {{1e-2 / 3, 1e-6 / 7, {1e-5, 2e-5, 3e-5}, {4e-5, 5e-5, 6e-5}, {0, 0, 0}},
                         {0, 0, {0, 0, 0}, {0, 0, 1e-5}, {1e-3, 0, 1e-4}}};
  for (const auto& row : clean_pass().star_tracker.rows) {
    truth.t.push_back(sample_calibration().epoch + from_seconds(row[0]));
    truth.q_in_c.emplace_back(row[4], row[1], row[2], row[3]);
    truth.h_in.insert(truth.h_in.end(), {1, 0, 0, 0, 0.6, 0.8});
  }
  return truth;
}

Calibration sample_calibration() {
  Calibration calibration;
  calibration.estimator = Estimator::kInvariant;
  calibration.epoch = Time(std::chrono::sys_days(std::chrono::year(2009) / 5 / 20) -
                           std::chrono::sys_days(std::chrono::year(1958) / 1 / 1));
  calibration.t = calibration.epoch + from_seconds(32400.125);
  for (int gyro = 1; gyro <= 2; ++gyro) {
    GyroCalibration one;
    for (int i = 0; i < Esg7::kSize; ++i) {
      one.drift_rad_s.push_back(1e-6 / (3.0 + i) * gyro);
    }
    one.alignment_rotation_vector_rad = {1e-3 / 3, -2e-3 / 7, -0.0};
    one.readout_bias = Eigen::Vector3d(1e-5, -2e-5, 3e-5 * gyro);
    one.momentum_in = Eigen::Vector3d(1, 2, gyro).normalized();
    calibration.gyros.push_back(one);
  }
  calibration.states = drift_and_alignment(kEsg7, 2);
  calibration.further = {{ParameterId::further(FurtherState::kClockOffset, 0, 0), 1e-2 / 3, 1e-4 / 7},
                         {ParameterId::further(FurtherState::kOrbitalError, 0, 0), -1e-5 / 3, 1e-6}};
  calibration.noise = CalibrationNoise{1e-8 / 3, Eigen::Vector3d(1e-5, 2e-5, 1e-4) / 7, 1e-7 / 3, 1200};
  calibration.on_board_drift = OnBoardDrift{vsh(3), 1e-9 / 3};
  const Eigen::Index n = 20;
  calibration.covariance = Eigen::MatrixXd::Identity(n, n) * (1e-12 / 3);
  calibration.covariance(3, 4) = calibration.covariance(4, 3) = 1e-13 / 7;
  calibration.verdict.trustworthy = false;
  calibration.verdict.findings = {
      {FindingCode::kNisOutOfBounds, "The innovations are \"too large\".", "4.7 instead of 4", "add harmonics",
       Finding::Severity::kDoNotUse},
      {FindingCode::kNotDetermined, "One direction is not determined.", "", "slew", Finding::Severity::kNote}};
  calibration.statistics.nis_mean = M_PI / 3;
  calibration.statistics.fixes = 10800;
  return calibration;
}

Calibration sample_with_drift_that_comes_back() {
  Calibration calibration = sample_calibration();
  for (std::size_t k = 0; k < calibration.gyros.size(); ++k) {
    calibration.gyros[k].orbital_drift = {{4e-8, -3e-8, 2e-8}, {-2e-8, 3e-8, 5e-8}, 1.1e-3, calibration.epoch};
    for (int i = 0; i < Layout::kOrbitalDrift; ++i) {
      calibration.further.push_back({ParameterId::further(FurtherState::kOrbitalDrift, k, i), 3e-8, 1e-9});
    }
  }
  for (std::size_t k = 0; k < calibration.gyros.size(); ++k) {
    PolhodeDrift& drift = calibration.gyros[k].polhode.emplace();
    drift.polhode = {static_cast<float>(5000 + 700 * k), 0.03125F};
    drift.zero_at = calibration.epoch;
    for (int i = 0; i < Layout::kEq1; ++i) {
      drift.sine_rad_s(i) = 1e-8 * (i - 3);
      drift.cosine_rad_s(i) = 2e-8 * (i + 1);
    }
    for (int i = 0; i < Layout::kPolhode; ++i) {
      const double value = i < Layout::kEq1 ? drift.sine_rad_s(i) : drift.cosine_rad_s(i - Layout::kEq1);
      calibration.further.push_back({ParameterId::further(FurtherState::kPolhode, k, i), value, 1e-9});
    }
  }
  constexpr Eigen::Index kAmplitudes = 2 * (Layout::kOrbitalDrift + Layout::kPolhode);
  calibration.amplitude_covariance.setZero(kAmplitudes, calibration.covariance.rows() + kAmplitudes);
  calibration.amplitude_covariance.rightCols(kAmplitudes) = 1e-18 * Eigen::MatrixXd::Identity(kAmplitudes, kAmplitudes);
  calibration.amplitude_covariance(3, 0) = 1e-20;
  calibration.amplitude_covariance(17, 2) = -1e-20;
  return calibration;
}

Defect only(const std::vector<Defect>& defects, Defect::Kind kind) {
  EXPECT_EQ(std::ranges::count(defects, kind, &Defect::kind), 1);
  const auto found = std::ranges::find(defects, kind, &Defect::kind);
  return found == defects.end() ? Defect{} : *found;
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string orbit_message(bool xml) {
  TimeText utc(TimeScale::kUtc);
  const auto stamp = [&](double t_s) {
    return utc.format(sample_calibration().epoch + from_seconds(t_s)).substr(0, 19);
  };
  const auto entry = [&](std::string_view key, std::string_view value) {
    return xml ? fmt::format("<{0}>{1}</{0}>\n", key, value) : fmt::format("{} = {}\n", key, value);
  };
  const auto put = [&](std::string_view kvn, std::string_view tags) { return std::string(xml ? tags : kvn); };
  std::string text = put("CCSDS_OEM_VERS = 2.0\nCOMMENT round\n",
                         "<?xml version=\"1.0\"?>\n<oem id=\"CCSDS_OEM_VERS\" version=\"2.0\">\n<header>\n");
  text += entry("CREATION_DATE", "2026-01-02T03:04:05Z") + entry("ORIGINATOR", "TEST") + put("", "</header>\n<body>\n");
  constexpr double kRadius_km = 7000;
  constexpr double kRate_rad_s = 1.0780076e-3;
  for (const int segment : {0, 1}) {
    const double begin_s = segment == 0 ? 0 : 480;
    const double end_s = segment == 0 ? 600 : 1200;
    text += put("META_START\n", "<segment>\n<metadata>\n");
    text += entry("OBJECT_NAME", "TEST") + entry("OBJECT_ID", "2026-001A") + entry("CENTER_NAME", "EARTH") +
            entry("REF_FRAME", "EME2000") + entry("TIME_SYSTEM", "UTC") + entry("START_TIME", stamp(begin_s));
    text += segment == 0 ? entry("USEABLE_STOP_TIME", stamp(540)) : entry("USEABLE_START_TIME", stamp(540));
    text += entry("STOP_TIME", stamp(end_s));
    if (segment == 0) {
      text += entry("INTERPOLATION", "LAGRANGE") + entry("INTERPOLATION_DEGREE", "5");
    }
    text += put("META_STOP\nCOMMENT states\n", "</metadata>\n<data>\n<COMMENT>states</COMMENT>\n");
    for (double t_s = begin_s; t_s <= end_s; t_s += 60) {
      const double c = std::cos(kRate_rad_s * t_s);
      const double s = std::sin(kRate_rad_s * t_s);
      const double speed = kRate_rad_s * kRadius_km;
      const std::string state = xml ? "<stateVector><EPOCH>{}</EPOCH><X>{:.9f}</X><Y units=\"km\">{:.9f}</Y><Z>{}</Z>"
                                      "<X_DOT>{:.12f}</X_DOT><Y_DOT>{:.12f}</Y_DOT><Z_DOT>{}</Z_DOT></stateVector>\n"
                                    : "{} {:.9f} {:.9f} {} {:.12f} {:.12f} {}\n";
      text += fmt::format(fmt::runtime(state), stamp(t_s), kRadius_km * c, kRadius_km * s, 0, -speed * s, speed * c, 0);
    }
    if (!xml && segment == 0) {
      text += "COVARIANCE_START\nEPOCH = " + stamp(0) + "\n1\nCOVARIANCE_STOP\n";
    }
    text += put("", "</data>\n</segment>\n");
  }
  return text + put("", "</body>\n</oem>\n");
}

void expect_same_pass(const Pass& a, const Pass& b, double h_tolerance, double q_tolerance) {
  const PassSettings& s = a.settings;
  const PassSettings& r = b.settings;
  EXPECT_EQ(s.spacecraft, r.spacecraft);
  EXPECT_EQ(s.start_up, r.start_up);
  EXPECT_EQ(s.epoch, r.epoch);
  EXPECT_EQ(s.duration, r.duration);
  EXPECT_EQ(s.gyro_period, r.gyro_period);
  EXPECT_EQ(s.star_tracker_period, r.star_tracker_period);
  EXPECT_EQ(s.star_tracker_noise_rad, r.star_tracker_noise_rad);
  ASSERT_EQ(s.gyros.size(), r.gyros.size());
  for (std::size_t i = 0; i < s.gyros.size(); ++i) {
    EXPECT_EQ(s.gyros[i].readout_noise_rad, r.gyros[i].readout_noise_rad);
    EXPECT_EQ(s.gyros[i].drift_rad_s, r.gyros[i].drift_rad_s);
    EXPECT_EQ(s.gyros[i].drift_sigma_rad_s, r.gyros[i].drift_sigma_rad_s);
    EXPECT_EQ(s.gyros[i].alignment_rotation_vector_rad, r.gyros[i].alignment_rotation_vector_rad);
    EXPECT_EQ(s.gyros[i].alignment_sigma_rad, r.gyros[i].alignment_sigma_rad);
  }
  EXPECT_EQ(a.gyro.gyros, b.gyro.gyros);
  EXPECT_EQ(a.gyro.t, b.gyro.t);
  EXPECT_EQ(a.star_tracker.t, b.star_tracker.t);
  ASSERT_EQ(a.gyro.h.size(), b.gyro.h.size());
  const auto differ = [](double x, double y, double tolerance) {
    return std::isnan(x) != std::isnan(y) || std::abs(x - y) > tolerance;
  };
  std::ptrdiff_t different = 0;
  for (std::size_t i = 0; i < a.gyro.h.size(); ++i) {
    different += differ(a.gyro.h[i], b.gyro.h[i], h_tolerance) ? 1 : 0;
  }
  EXPECT_EQ(different, 0) << "direction cosines";
  ASSERT_EQ(a.star_tracker.size(), b.star_tracker.size());
  for (std::size_t i = 0; i < a.star_tracker.size(); ++i) {
    for (Eigen::Index k = 0; k < 4; ++k) {
      different +=
          differ(a.star_tracker.q_in_c[i].coeffs()(k), b.star_tracker.q_in_c[i].coeffs()(k), q_tolerance) ? 1 : 0;
    }
  }
  EXPECT_EQ(different, 0) << "quaternions";
}

}  // namespace trihedron::io
