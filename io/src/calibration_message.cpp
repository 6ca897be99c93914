#include "trihedron/io/calibration_message.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>

#include "acm_keywords.hpp"
#include "ndm_text.hpp"
#include "trihedron/io/atomic_file.hpp"
#include "trihedron/io/error.hpp"
#include "trihedron/io/time_text.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::io {

std::string acm_keyword(std::string_view name) {
  std::string result;
  for (const char c : name) {
    if (c == '-') {
      result.push_back('M');
    } else if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      result.push_back(static_cast<char>(std::toupper(static_cast<unsigned char>(c))));
    } else if (c != ')') {
      result.push_back('_');
    }
  }
  return result;
}

std::string acm_field_level(int gyro, DriftCoefficient::Member potential, int degree) {
  return fmt::format("GYRO{}_FIELD_{}{}", gyro + 1, potential == DriftCoefficient::Member::kW ? 'W' : 'D', degree);
}

namespace {

std::string number(double value) { return fmt::format("{:.15e}", value); }

/// The parts of an ACM in their order.
class AcmWriter {
 public:
  AcmWriter(const Calibration& calibration, const CalibrationContext& context, const MessageDescription& description,
            MessageSyntax syntax)
      : calibration_(calibration),
        context_(context),
        description_(description),
        text_(syntax),
        time_(description.time_scale),
        id_(fmt::format("AD_{}", format_epoch(calibration.t))) {}

  std::string write() {
    text_.header("ACM",
                 "Calibration of electrostatic gyros; the keywords TRIHEDRON_... are described in its documentation",
                 description_);
    metadata();
    text_.put("", "<data>\n");
    if (has_attitude()) {
      attitude();
    }
    if (has_covariance()) {
      covariance();
    }
    manoeuvres();
    determination();
    user_defined();
    text_.put("", "</data>\n</segment>\n");
    text_.end("ACM");
    return text_.text();
  }

 private:
  [[nodiscard]] bool has_attitude() const { return context_.attitude != nullptr; }
  [[nodiscard]] bool has_covariance() const { return has_attitude() && !context_.attitude->attitude.sigma_rad.empty(); }
  /// Seconds since EPOCH_TZERO, to nanoseconds.
  [[nodiscard]] std::string relative(Time t) const { return format_seconds(t - calibration_.epoch); }

  void metadata() {
    text_.put("\nMETA_START\n", "<segment>\n<metadata>\n");
    text_.entry("OBJECT_NAME", description_.object_name);
    text_.entry("INTERNATIONAL_DESIGNATOR", description_.object_id);
    text_.entry("TIME_SYSTEM", name_of(description_.time_scale));
    text_.entry("EPOCH_TZERO", time_.format(calibration_.epoch));
    text_.entry("ACM_DATA_ELEMENTS",
                fmt::format("{}{}{}AD, USER", has_attitude() ? "ATT, " : "", has_covariance() ? "COV, " : "",
                            context_.manoeuvres.empty() ? "" : "MAN, "));
    Time start = calibration_.t;
    Time stop = calibration_.t;
    if (has_attitude()) {
      start = std::min(start, context_.attitude->attitude.t.front());
      stop = std::max(stop, context_.attitude->attitude.t.back());
    }
    text_.entry("START_TIME", relative(start));
    text_.entry("STOP_TIME", relative(stop));
    text_.put("META_STOP\n", "</metadata>\n");
  }

  void line(const std::string& tag, const std::string& values) {
    text_.put(text_.kvn() ? values + "\n" : fmt::format("<{0}>{1}</{0}>\n", tag, values));
  }

  /// The rates of an attitude have their place in AEM and APM: a message may hold an attitude once only.
  void attitude() {
    const AttitudeHistory& attitude = context_.attitude->attitude;
    const std::vector<Eigen::Vector3d>& bias = context_.gyro_bias_rad_s;
    text_.put("\nATT_START\n", "<att>\n");
    if (!bias.empty()) {
      text_.entry(
          "COMMENT",
          "GYRO_BIAS is the drift as its equivalent: angular velocity by momenta that are taken to stand still, "
          "less the true one");
    }
    text_.entry("ATT_BASIS", "DETERMINED_GND");
    text_.entry("ATT_BASIS_ID", id_);
    text_.entry("REF_FRAME_A", description_.inertial_frame);
    text_.entry("REF_FRAME_B", description_.body_frame);
    text_.entry("NUMBER_STATES", bias.empty() ? "4" : "7");
    text_.entry("ATT_TYPE", "QUATERNION");
    if (!bias.empty()) {
      text_.entry("RATE_TYPE", "GYRO_BIAS");
    }
    for (std::size_t i = 0; i < attitude.size(); ++i) {
      check_stop();
      const Eigen::Quaterniond& q = attitude.q_in_c[i];
      std::string values =
          fmt::format("{} {:.15e} {:.15e} {:.15e} {:.15e}", relative(attitude.t[i]), q.x(), q.y(), q.z(), q.w());
      if (!bias.empty()) {
        const Eigen::Vector3d deg_s = bias[i] * kDegreesPerRadian;
        values += fmt::format(" {:.6e} {:.6e} {:.6e}", deg_s.x(), deg_s.y(), deg_s.z());
      }
      line("attLine", values);
    }
    text_.put("ATT_STOP\n", "</att>\n");
  }

  void covariance() {
    const AttitudeHistory& attitude = context_.attitude->attitude;
    text_.put("\nCOV_START\n", "<cov>\n");
    text_.entry("COMMENT", "Where an attitude has no sigma its epoch is left out");
    text_.entry("COV_BASIS", "DETERMINED_GND");
    text_.entry("COV_REF_FRAME", description_.body_frame);
    text_.entry("COV_TYPE", "ANGLE");
    for (std::size_t i = 0; i < attitude.size(); ++i) {
      const Eigen::Vector3d variance = (attitude.sigma_rad[i] * kDegreesPerRadian).array().square();
      if (variance.allFinite()) {
        line("covLine",
             fmt::format("{} {:.6e} {:.6e} {:.6e}", relative(attitude.t[i]), variance.x(), variance.y(), variance.z()));
      }
    }
    text_.put("COV_STOP\n", "</cov>\n");
  }

  void manoeuvres() {
    int number = 0;
    for (const Manoeuvre& its : context_.manoeuvres) {
      text_.put("\nMAN_START\n", "<man>\n");
      text_.entry("MAN_ID", fmt::format("SLEW_{}", ++number));
      text_.entry("MAN_PURPOSE", "ATT_ADJUST");
      text_.entry("MAN_BEGIN_TIME", relative(its.begin));
      text_.entry("MAN_END_TIME", relative(its.end));
      if (its.target_q_in_c) {
        const Eigen::Quaterniond& q = *its.target_q_in_c;
        text_.entry("TARGET_ATTITUDE", fmt::format("{:.15e} {:.15e} {:.15e} {:.15e}", q.x(), q.y(), q.z(), q.w()));
      }
      text_.put("MAN_STOP\n", "</man>\n");
    }
  }

  /// As text only: the standard's text, its schema and Orekit name the element of XML differently.
  void sensor(int number, std::string_view kind, Duration period) {
    if (!text_.kvn()) {
      return;
    }
    text_.put("SENSOR_START\n");
    text_.entry("SENSOR_NUMBER", std::to_string(number));
    text_.entry("SENSOR_USED", kind);
    if (period > Duration::zero()) {
      text_.entry("SENSOR_FREQUENCY", fmt::format("{:.9e}", 1 / to_seconds(period)), "Hz");
    }
    text_.put("SENSOR_STOP\n");
  }

  void determination() {
    text_.put("\nAD_START\n", "<ad>\n");
    text_.entry("COMMENT", fmt::format("Estimator {}", name_of(calibration_.estimator)));
    text_.entry("AD_ID", id_);
    text_.entry("AD_METHOD", calibration_.estimator == Estimator::kBatch ? "BATCH" : "EKF");
    text_.entry("ATTITUDE_SOURCE", "GND");
    text_.entry("NUMBER_STATES", std::to_string(calibration_.states.size() + calibration_.further.size()));
    text_.entry("ATTITUDE_STATES", "QUATERNION");
    if (has_covariance()) {
      text_.entry("COV_TYPE", "ANGLE");
    }
    text_.entry("REF_FRAME_A", description_.inertial_frame);
    text_.entry("REF_FRAME_B", description_.body_frame);
    const PassSettings* pass = context_.pass;
    int number = 1;
    for (std::size_t head = 0; head < star_trackers(); ++head) {
      sensor(number++, "AST", pass != nullptr ? pass->star_tracker_period : Duration::zero());
    }
    for (std::size_t k = 0; k < calibration_.gyros.size(); ++k) {
      sensor(number++, "GYRO", pass != nullptr ? pass->gyro_period : Duration::zero());
    }
    text_.put("AD_STOP\n", "</ad>\n");
  }

  void user(const std::string& key, std::string_view value) {
    if (text_.kvn()) {
      text_.entry(std::string(kAcmPrefix) + key, value);
    } else {
      text_.put(
          fmt::format("<USER_DEFINED parameter=\"TRIHEDRON_{}\">{}</USER_DEFINED>\n", key, escaped_for_xml(value)));
    }
  }

  /// A state and its 1-sigma; `unit` ends the keyword.
  void state(const std::string& key, const std::string& unit, double value, double sigma) {
    if (std::isfinite(value)) {
      user(key + unit, number(value));
    }
    if (std::isfinite(sigma)) {
      user(key + "_SIGMA" + unit, number(sigma));
    }
  }

  [[nodiscard]] std::size_t star_trackers() const {
    return 1 + (context_.pass != nullptr ? context_.pass->further_star_trackers.size() : 0);
  }

  void star_tracker_noise(std::size_t head, const Eigen::Vector3d& noise_rad) {
    user(fmt::format("STAR_TRACKER{}_NOISE_RAD", head + 1),
         fmt::format("{:.6e} {:.6e} {:.6e}", noise_rad.x(), noise_rad.y(), noise_rad.z()));
  }

  /// Noise: as told by the pass, or as found by the calibration. Not among the keywords of sensors, because peers
  /// differ about the number of elements before it.
  void sensors() {
    const PassSettings* pass = context_.pass;
    user("STAR_TRACKERS", std::to_string(star_trackers()));
    user("GYROS", std::to_string(calibration_.gyros.size()));
    if (calibration_.noise && calibration_.noise->star_tracker_noise_rad) {
      star_tracker_noise(0, *calibration_.noise->star_tracker_noise_rad);
    } else if (pass != nullptr) {
      star_tracker_noise(0, pass->star_tracker_noise_rad);
    }
    if (pass == nullptr) {
      return;
    }
    for (std::size_t head = 0; head < pass->further_star_trackers.size(); ++head) {
      star_tracker_noise(head + 1, pass->further_star_trackers[head].noise_rad);
    }
    for (std::size_t k = 0; k < std::min(calibration_.gyros.size(), pass->gyros.size()); ++k) {
      user(fmt::format("GYRO{}_READOUT_NOISE_RAD", k + 1), fmt::format("{:.6e}", pass->gyros[k].readout_noise_rad));
    }
  }

  /// Of stamps, and noise and drift field that the calibration went by.
  void clocks() {
    if (const std::optional<ClockCorrection>& clocks = calibration_.clocks) {
      user("CLOCKS_OFFSET_S", number(clocks->offset_s));
      user("CLOCKS_RATE_S_S", number(clocks->rate_s_s));
      for (std::size_t k = 0; k < calibration_.gyros.size(); ++k) {
        user(fmt::format("GYRO{}_LATE_S", k + 1), number(clocks->late_s[static_cast<int>(k)]));
      }
    }
  }

  void levels() {
    if (const std::optional<CalibrationNoise>& noise = calibration_.noise) {
      user("NOISE_DIRECTION_RANDOM_WALK_RAD_SQRT_S", number(noise->direction_random_walk_rad_sqrt_s));
      user("NOISE_WANDERING_DRIFT_RAD_S", number(noise->wandering_drift_rad_s));
      user("NOISE_WANDERING_TIME_S", number(noise->wandering_time_s));
      if (noise->star_tracker_noise_rad) {
        const Eigen::Vector3d& found = *noise->star_tracker_noise_rad;
        user("NOISE_STAR_TRACKER_RAD",
             fmt::format("{} {} {}", number(found.x()), number(found.y()), number(found.z())));
      }
    }
    for (const DriftFieldLevel& level : calibration_.drift_field) {
      const std::string owner = acm_field_level(level.gyro, level.potential, level.degree);
      user(owner + "_RMS_RAD_S", number(level.rms_rad_s));
      user(owner + "_SIGMA_FACTOR", number(level.sigma_factor));
    }
    if (const std::optional<OnBoardDrift>& on_board = calibration_.on_board_drift) {
      user("ON_BOARD_DRIFT_MODEL", name_of(on_board->drift_model));
      user("ON_BOARD_RANDOM_WALK_RAD_SQRT_S", number(on_board->random_walk_rad_sqrt_s));
    }
  }

  void user_defined() {
    text_.put("\nUSER_START\n", "<user>\n");
    user("VERDICT", calibration_.verdict.trustworthy ? "TRUSTWORTHY" : "DO NOT USE");
    std::vector<std::string_view> findings;
    std::vector<std::string_view> severities;
    for (const Finding& finding : calibration_.verdict.findings) {
      findings.push_back(name_of(finding.code));
      severities.push_back(name_of(finding.severity));
    }
    if (!findings.empty()) {
      user("FINDINGS", fmt::format("{}", fmt::join(findings, " ")));
      user("SEVERITIES", fmt::format("{}", fmt::join(severities, " ")));
    }
    user("ESTIMATOR", name_of(calibration_.estimator));
    user("EPOCH_S", relative(calibration_.t));
    if (!calibration_.start_up.empty()) {
      expect_plain(calibration_.start_up, "the name of the start-up of the rotors,");
      user("START_UP", calibration_.start_up);
    }
    if (!context_.covariance_file.empty()) {
      user("COVARIANCE_FILE", context_.covariance_file);
    }
    sensors();
    constexpr std::string_view kAxes = "XYZ";
    for (std::size_t k = 0; k < calibration_.gyros.size(); ++k) {
      const GyroCalibration& gyro = calibration_.gyros[k];
      const std::string owner = fmt::format("GYRO{}_", k + 1);
      user(owner + "DRIFT_MODEL", name_of(gyro.drift_model));
      const std::vector<DriftCoefficient> coefficients = coefficients_of(gyro.drift_model);
      for (std::size_t i = 0; i < coefficients.size(); ++i) {
        state(owner + acm_keyword(name_of(coefficients[i])), "_RAD_S", gyro.drift_rad_s.at(i),
              sigma_of(calibration_, ParameterId::drift(k, coefficients[i])));
      }
      for (int axis = 0; axis < 3; ++axis) {
        const char letter = kAxes[static_cast<std::size_t>(axis)];
        state(fmt::format("{}ALIGN_{}", owner, letter), "_RAD", gyro.alignment_rotation_vector_rad(axis),
              sigma_of(calibration_, ParameterId::alignment(k, axis)));
        user(fmt::format("{}MOMENTUM_IN_{}", owner, letter), number(gyro.momentum_in(axis)));
        user(fmt::format("{}COSINE_BIAS_{}", owner, letter), number(gyro.readout_bias(axis)));
      }
      if (gyro.polhode) {
        user(owner + "POLHODE_PERIOD_S", number(static_cast<double>(gyro.polhode->polhode.period_s)));
        user(owner + "POLHODE_PERIOD_RATE", number(static_cast<double>(gyro.polhode->polhode.period_rate)));
      }
    }
    if (const std::optional<OrbitalDrift>& orbital = calibration_.gyros.front().orbital_drift) {
      user("ORBITAL_RATE_RAD_S", number(orbital->rate_rad_s));
    }
    for (const FurtherEstimate& further : calibration_.further) {
      state(acm_keyword(name_of(further.parameter)), "", further.value, further.sigma);
    }
    clocks();
    levels();
    if (calibration_.determined) {
      user("DETERMINED", std::to_string(calibration_.determined->coefficients));
      user("DETERMINED_OF", std::to_string(calibration_.determined->of));
    }
    for (const auto& [name, value] : named_values(calibration_.statistics)) {
      if (std::isfinite(value)) {
        user(std::string(kAcmStatistic) + acm_keyword(name), number(value));
      }
    }
    text_.put("USER_STOP\n", "</user>\n");
  }

  const Calibration& calibration_;
  const CalibrationContext& context_;
  const MessageDescription& description_;
  NdmText text_;
  TimeText time_;
  std::string id_;
};

}  // namespace

std::vector<Manoeuvre> slews_of(const AttitudeHistory& attitude, Duration gap) {
  constexpr double kLeast_rad_s = 1e-3;
  constexpr double kTimesUsual = 2;
  constexpr Duration kSame = std::chrono::minutes(1);
  std::vector<double> rates_rad_s;  // of the steps; none over a gap
  for (std::size_t i = 1; i < attitude.size(); ++i) {
    const Duration step = attitude.t[i] - attitude.t[i - 1];
    rates_rad_s.push_back(step > gap ? 0
                                     : attitude.q_in_c[i - 1].angularDistance(attitude.q_in_c[i]) / to_seconds(step));
  }
  if (rates_rad_s.empty()) {
    return {};
  }
  std::vector<double> sorted = rates_rad_s;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  const double limit_rad_s = std::max(kTimesUsual * *middle, kLeast_rad_s);
  std::vector<Manoeuvre> slews;
  for (std::size_t i = 0; i < rates_rad_s.size(); ++i) {
    if (rates_rad_s[i] > limit_rad_s) {
      if (slews.empty() || attitude.t[i] - slews.back().end > kSame) {
        slews.push_back({attitude.t[i], {}, {}});
      }
      slews.back().end = attitude.t[i + 1];
      slews.back().target_q_in_c = attitude.q_in_c[i + 1].normalized();
    }
  }
  return slews;
}

std::string format_acm(const Calibration& calibration, const CalibrationContext& context,
                       const MessageDescription& description, MessageSyntax syntax) {
  expect_writable_description(description);
  if (!context.covariance_file.empty()) {
    expect_plain(context.covariance_file, "the name of the covariance file,");
  }
  if (description.time_scale == TimeScale::kTdb) {
    throw UsageError("--time-system TDB: its seconds are not those of the calibration; use TAI, UTC, GPS or TT");
  }
  return AcmWriter(calibration, context, description, syntax).write();
}

}  // namespace trihedron::io
