#include "synthetic_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

#include "trihedron/core/drift.hpp"
#include "trihedron/records/run.hpp"
#include "units.hpp"

namespace trihedron::report::test {
namespace {

constexpr int kGyros = 2;
constexpr double kOrbit_s = 5640;
constexpr double kRate_rad_s = 2 * std::numbers::pi / kOrbit_s;
constexpr std::size_t kCoefficients = Esg7::kSize;
constexpr std::size_t kPerGyro = kCoefficients + 3;

class Generator {
 public:
  explicit Generator(const SyntheticOptions& options) : options_(options) {}

  SyntheticRun make() {
    make_settings();
    make_truth();
    make_telemetry();
    make_parameters();
    make_fixes();
    make_attitude();
    make_angle();
    make_calibration();
    return std::move(out_);
  }

 private:
  double normal() { return normal_(random_); }
  double uniform() { return uniform_(random_); }
  [[nodiscard]] Time at(double t_s) const { return out_.pass.settings.epoch + from_seconds(t_s); }
  [[nodiscard]] double seconds(Time t) const { return to_seconds(t - out_.pass.settings.epoch); }
  [[nodiscard]] bool in_outage(double t_s) const { return options_.troubled && t_s > 12000 && t_s < 14520; }

  void make_settings() {
    PassSettings& settings = out_.pass.settings;
    settings.spacecraft = options_.spacecraft;
    settings.epoch = Time(std::chrono::sys_days{std::chrono::year{2009} / 5 / 20} -
                          std::chrono::sys_days{std::chrono::year{1958} / 1 / 1});
    settings.duration = options_.duration;
    settings.gyro_period = std::chrono::milliseconds(125);
    settings.star_tracker_period = std::chrono::seconds(3);
    settings.star_tracker_noise_rad = Eigen::Vector3d(3, 3, 20) * kArcsecond_rad;
    settings.gyros.resize(kGyros);
    for (GyroPrior& prior : settings.gyros) {
      prior.readout_noise_rad = 2 * kArcsecond_rad;
      prior.drift_common_sigma_rad_s = 2e-6;
      prior.alignment_sigma_rad.setConstant(30 * kArcminute_rad);
    }
  }

  void make_truth() {
    for (int k = 0; k < kGyros; ++k) {
      Truth::Gyro gyro;
      for (const DriftCoefficient& coefficient : coefficients_of(kEsg7)) {
        gyro.drift_rad_s.emplace_back(coefficient, 2e-6 * normal());
      }
      gyro.alignment_rotation_vector_rad =
          Eigen::Vector3d(normal(), normal(), normal()).normalized() * 30 * kArcminute_rad;
      out_.truth.gyros.push_back(gyro);
    }
  }

  /// Roll of an imaging slew now and then.
  [[nodiscard]] static double roll(double t_s) {
    const double phase = std::fmod(t_s, 4100.0);
    const double size = 0.5 * std::sin(1 + std::floor(t_s / 4100.0) * 2.4);
    return phase < 700 ? size * std::pow(std::sin(std::numbers::pi * phase / 700), 2) : 0;
  }

  [[nodiscard]] static Eigen::Quaterniond attitude(double t_s) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(kRate_rad_s * t_s, Eigen::Vector3d::UnitY()) *
                              Eigen::AngleAxisd(roll(t_s), Eigen::Vector3d::UnitX()));
  }

  void make_telemetry() {
    GyroTelemetry& gyro = out_.pass.gyro;
    gyro.gyros = kGyros;
    const std::array<Eigen::Vector3d, kGyros> h_in = {Eigen::Vector3d(0.995, 0.087, 0.045),
                                                      Eigen::Vector3d(0.14, 0.985, 0.094)};
    long good = 0;
    long bad = 0;
    for (long i = 0; i < options_.duration / out_.pass.settings.gyro_period; ++i) {
      const double t_s = static_cast<double>(i) * 0.125;
      gyro.t.push_back(at(t_s));
      const bool broken = options_.troubled && uniform() < 0.001 + (t_s > 20000 && t_s < 20600 ? 0.5 : 0);
      ++(broken ? bad : good);
      for (const Eigen::Vector3d& direction : h_in) {
        const Eigen::Vector3d h = attitude(t_s).conjugate() * direction.normalized();
        for (int axis = 0; axis < 3; ++axis) {
          gyro.h.push_back(broken ? std::numeric_limits<double>::quiet_NaN() : h(axis) + 1e-5 * normal());
        }
      }
    }
    out_.run.samples[SampleStatus::kUsed] = good;
    out_.run.samples[SampleStatus::kRejectedNotDirection] = bad;
    for (long i = 0; i < options_.duration / out_.pass.settings.star_tracker_period; ++i) {
      const double t_s = static_cast<double>(i) * 3;
      if (!in_outage(t_s) && !(options_.troubled && uniform() < 0.02)) {
        out_.pass.star_tracker.t.push_back(at(t_s));
        out_.pass.star_tracker.q_in_c.push_back(attitude(t_s));
      }
    }
  }

  [[nodiscard]] double truth_of(std::size_t column) const {
    const Truth::Gyro& gyro = out_.truth.gyros[column / kPerGyro];
    const std::size_t i = column % kPerGyro;
    return i < kCoefficients ? gyro.drift_rad_s[i].second
                             : gyro.alignment_rotation_vector_rad(static_cast<Eigen::Index>(i - kCoefficients));
  }

  void make_parameters() {
    ParameterHistory& history = out_.run.parameters;
    constexpr std::size_t kStates = kGyros * kPerGyro;
    std::array<double, kStates> wander{};
    for (const Time t : out_.pass.star_tracker.t) {
      const double t_s = seconds(t);
      history.t.push_back(t);
      std::vector<double>& value = history.value.emplace_back();
      std::vector<double>& sigma = history.sigma.emplace_back();
      for (std::size_t column = 0; column < kStates; ++column) {
        const std::size_t i = column % kPerGyro;
        const bool alignment = i >= kCoefficients;
        const bool unknown = options_.troubled && column == kPerGyro + 4;
        const double first = alignment ? 30 * kArcminute_rad : 2e-6;
        const double last = unknown     ? 0.8 * first
                            : alignment ? 1.5 * kArcsecond_rad
                                        : 1.2e-9 * (1 + static_cast<double>(i));
        const double settling_s = unknown ? 1e6 : alignment ? 500 : 1300 + 260 * static_cast<double>(i);
        const double decay = std::exp(-t_s / settling_s);
        const double growth = std::sqrt(to_seconds(options_.duration) / std::max(t_s, 60.0));
        wander[column] = 0.999 * wander[column] + 0.0447 * normal();
        sigma.push_back(std::min(first, std::hypot(first * decay, last * growth)));
        value.push_back(truth_of(column) * (1 - decay) + wander[column] * (unknown ? 0.02 * first : last * growth) +
                        0.12 * first * decay * std::sin(kRate_rad_s * t_s * 2 + static_cast<double>(column)) *
                            std::min(1.0, t_s / 300));
      }
    }
  }

  void make_fixes() {
    double corrected_s = -1e9;
    for (const Time t : out_.pass.star_tracker.t) {
      FixRecord fix;
      fix.t = t;
      const bool first = out_.run.fixes.empty();
      const bool outlier = !first && options_.troubled && uniform() < 0.01;
      const double start = 1 + 20 * std::exp(-seconds(t) / 120);
      fix.innovation.resize(4);
      fix.innovation_sigma.resize(4);
      fix.degrees_of_freedom = 4;
      for (std::size_t i = 0; i < fix.innovation.size(); ++i) {
        fix.innovation_sigma[i] = (5 + 4 * static_cast<double>(i % 2)) * start * kArcsecond_rad;
        fix.innovation[i] = fix.innovation_sigma[i] * normal() + (outlier ? 2 * kDegree_rad * (uniform() - 0.5) : 0);
        fix.nis += std::pow(fix.innovation[i] / fix.innovation_sigma[i], 2);
      }
      fix.status = first ? FixStatus::kStarted : outlier ? FixStatus::kRejectedByGate : FixStatus::kUsed;
      if (!outlier && seconds(t) - corrected_s >= 5400) {
        fix.corrected_navigator = true;
        corrected_s = seconds(t);
      }
      ++out_.run.fix_counts[fix.status];
      out_.run.fixes.push_back(fix);
    }
  }

  void make_attitude() {
    ground::AttitudeErrors navigation;
    ground::AttitudeErrors calibrating;
    double corrected_s = 0;
    for (const FixRecord& fix : out_.run.fixes) {
      const double t_s = seconds(fix.t);
      corrected_s = fix.corrected_navigator ? t_s : corrected_s;
      const double age_s = t_s - corrected_s;
      const double size = (13 * std::exp(-corrected_s / 4000) + 0.35) * kArcminute_rad * age_s / 5400;
      navigation.t.push_back(fix.t);
      navigation.error_rad.emplace_back(size * std::sin(kRate_rad_s * t_s),
                                        size * (0.3 + 0.2 * std::cos(kRate_rad_s * t_s)),
                                        size * std::cos(kRate_rad_s * t_s));
      navigation.error_rad.back() += Eigen::Vector3d(normal(), normal(), normal()) * kArcsecond_rad;
      navigation.sigma_rad.emplace_back(Eigen::Vector3d::Constant(size + kArcsecond_rad));
      navigation.age_s.push_back(age_s);

      const Eigen::Vector3d sigma_rad =
          Eigen::Vector3d(1.5, 1.4, 2.2) * (1 + 12 * std::exp(-t_s / 900)) * kArcsecond_rad;
      calibrating.t.push_back(fix.t);
      calibrating.error_rad.emplace_back(sigma_rad.cwiseProduct(Eigen::Vector3d(normal(), normal(), normal())));
      calibrating.sigma_rad.push_back(sigma_rad);
      out_.run.attitude.t.push_back(fix.t);
      out_.run.attitude.q_in_c.push_back(attitude(t_s));
      out_.run.attitude.sigma_rad.push_back(sigma_rad);
    }
    const auto evaluated = [&](ground::AttitudeErrors errors) {
      return ground::summarised(std::move(errors), ground::ReferenceKind::kTruth, out_.pass.settings.epoch,
                                ground::kAttitudeLimit_rad);
    };
    out_.evaluation.navigation = evaluated(std::move(navigation));
    out_.evaluation.attitude = evaluated(std::move(calibrating));
    make_open_loops();
  }

  static PredictedError predicted_after(int minute, double sigma_rad_per_s) {
    const double sigma_rad = 1e-5 + sigma_rad_per_s * 60 * minute;
    PredictedError error;
    error.after = std::chrono::minutes(minute);
    error.covariance_rad2.diagonal().setConstant(sigma_rad * sigma_rad);
    error.error_68_rad = 1.9 * sigma_rad;
    error.error_95_rad = 2.8 * sigma_rad;
    error.error_997_rad = 3.7 * sigma_rad;
    return error;
  }

  /// The error grows as a share of the time since the correction, the smaller the later the correction.
  void make_open_loops() {
    ground::CalibrationEvaluation& evaluation = out_.evaluation;
    const double end_s = seconds(out_.run.fixes.back().t);
    for (double from_s = 0; from_s <= end_s; from_s += 5400) {
      const auto grown = [&](double rad_per_s) {
        ground::AttitudeErrors errors;
        for (double age_s = 0; from_s + age_s <= end_s; age_s += 30) {
          errors.t.push_back(at(from_s + age_s));
          errors.error_rad.emplace_back(2 * kArcsecond_rad, rad_per_s * age_s, 0);
          errors.age_s.push_back(age_s);
        }
        return errors;
      };
      ground::OpenLoops loops{grown(2e-6), grown(from_s == 0 ? 2e-6 : 1e-7), {}, {}};
      loops.intervals = {ground::correction_intervals(loops.known_before, evaluation.limit_rad).front(),
                         ground::correction_intervals(loops.calibrated, evaluation.limit_rad).front()};
      for (int minute = 0; minute <= 540; minute += 10) {
        loops.predicted.push_back(predicted_after(minute, 2e-7));
      }
      evaluation.open_loops.push_back(loops);
      evaluation.extension.pairs.push_back(loops.intervals);
    }
    evaluation.extension.median = ground::median_extension(evaluation.open_loops);
    OpenLoopForecast& forecast = out_.run.calibration.forecast.emplace();
    for (int minute = 0; minute <= 1440; minute += 10) {
      forecast.errors.push_back(predicted_after(minute, 1e-7));
    }
    forecast.usual = {evaluation.limit_rad, std::chrono::minutes(80), false};
    forecast.need = NeedForecast{{1e-3, std::chrono::minutes(60)}, true, 9e-4, forecast.usual, {}};
  }

  void make_angle() {
    for (const FixRecord& fix : out_.run.fixes) {
      const double middle = 4e-6 * std::exp(-seconds(fix.t) / 2500) * std::sin(kRate_rad_s * seconds(fix.t));
      out_.run.angle_t.push_back(fix.t);
      out_.run.angle_residual_min.push_back(middle - 1.4e-5 * (1.5 + 0.3 * normal()));
      out_.run.angle_residual_max.push_back(middle + 1.4e-5 * (1.5 + 0.3 * normal()));
    }
  }

  void make_calibration() {
    Calibration& calibration = out_.run.calibration;
    calibration.estimator = out_.run.options.estimator;
    calibration.epoch = out_.pass.settings.epoch;
    calibration.t = out_.pass.gyro.t.back();
    calibration.verdict = options_.verdict;
    const std::vector<double>& value = out_.run.parameters.value.back();
    const std::vector<double>& sigma = out_.run.parameters.sigma.back();
    for (std::size_t k = 0; k < kGyros; ++k) {
      GyroCalibration gyro;
      for (std::size_t i = 0; i < kCoefficients; ++i) {
        gyro.drift_rad_s.push_back(value[k * kPerGyro + i]);
      }
      for (int axis = 0; axis < 3; ++axis) {
        gyro.alignment_rotation_vector_rad(axis) = value[k * kPerGyro + kCoefficients + static_cast<std::size_t>(axis)];
      }
      calibration.gyros.push_back(gyro);
    }
    calibration.states = drift_and_alignment(kEsg7, kGyros);
    const auto states = static_cast<Eigen::Index>(sigma.size());
    calibration.covariance.resize(states, states);
    for (Eigen::Index i = 0; i < states; ++i) {
      for (Eigen::Index j = 0; j < states; ++j) {
        const double rho =
            i == j ? 1
                   : 0.9 * std::cos(static_cast<double>(i * j)) * std::exp(-0.2 * std::abs(static_cast<double>(i - j)));
        calibration.covariance(i, j) = rho * sigma[static_cast<std::size_t>(i)] * sigma[static_cast<std::size_t>(j)];
      }
    }
    const std::vector<double>& sigma_before = out_.run.parameters.sigma.front();
    out_.run.known_before.covariance = Eigen::VectorXd::Map(sigma_before.data(), states).cwiseAbs2().asDiagonal();
    calibration.statistics.fixes = static_cast<long>(out_.run.fixes.size());
    calibration.statistics.nis_degrees_of_freedom = 4;
  }

  const SyntheticOptions& options_;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
  SyntheticRun out_;
};

}  // namespace

SyntheticRun synthetic_run(const SyntheticOptions& options) { return Generator(options).make(); }

std::vector<CatalogueEntry> synthetic_catalogue(const Calibration& like) {
  constexpr double kBetweenStartUps_rad_s = 1e-6;
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  std::vector<CatalogueEntry> catalogue;
  for (int start_up = 0; start_up < 3; ++start_up) {
    const double moved = kBetweenStartUps_rad_s * normal(random);
    for (const int passes : {1, 1, 2}) {
      CatalogueEntry entry{"Resurs-DK1", "pass-" + std::to_string(catalogue.size()),
                           "2009-0" + std::to_string(start_up + 1) + "-20", passes, like};
      Calibration& calibration = entry.calibration;
      calibration.epoch += std::chrono::hours(24) * (60 * start_up + static_cast<int>(catalogue.size()));
      calibration.t = calibration.epoch + (like.t - like.epoch);
      calibration.covariance = Eigen::MatrixXd(like.covariance.diagonal().asDiagonal()) / passes;
      calibration.verdict.trustworthy = !catalogue.empty();
      Eigen::Index state = 0;
      for (GyroCalibration& gyro : calibration.gyros) {
        for (double& value : gyro.drift_rad_s) {
          value += moved + std::sqrt(calibration.covariance(state, state)) * normal(random);
          ++state;
        }
        for (double& component : gyro.alignment_rotation_vector_rad) {
          component += std::sqrt(calibration.covariance(state, state)) * normal(random);
          ++state;
        }
      }
      catalogue.push_back(entry);
    }
  }
  // The last one has a coefficient that the others do not have.
  GyroCalibration& gyro = catalogue.back().calibration.gyros[0];
  gyro.drift_model = kEsg20;
  gyro.drift_rad_s.resize(static_cast<std::size_t>(kEsg20.size()), 1e-8);
  catalogue.back().calibration.states.push_back(parameter_named("gyro1.W(1,0)").value());
  const Eigen::Index states = like.covariance.rows() + 1;
  catalogue.back().calibration.covariance.conservativeResizeLike(
      Eigen::MatrixXd(Eigen::VectorXd::Constant(states, 1e-18).asDiagonal()));
  return catalogue;
}

SyntheticCampaign synthetic_campaign(std::size_t runs, double nees) {
  using Kind = Distribution::Kind;
  SyntheticCampaign campaign;
  CampaignPlan& plan = campaign.plan;
  plan.name = "What a designer does not know";
  plan.runs = runs;
  plan.inputs = {{"gyro.readout.noise", {.kind = Kind::kLoguniform, .a = 1, .b = 8}, "arcsec", {}, {}},
                 {"star_tracker.dropout_probability",
                  {.kind = Kind::kChoice, .options = 3},
                  "",
                  {"0", "0.050000000000000003", "0.20000000000000001"},
                  {0, 0.05, 0.2}},
                 {"attitude.programme", {.kind = Kind::kChoice, .options = 2}, "", {"orbital", "yaw-steered"}, {}}};
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (std::size_t run = 0; run < runs; ++run) {
    const double part = (static_cast<double>(run) + 0.5) / static_cast<double>(runs);
    RunRecord record;
    record.run = run;
    record.outcome = RunOutcome::kTrustworthy;
    record.draws = {std::pow(8, part), static_cast<double>(run % 3), static_cast<double>(run % 2)};
    for (const RunQuantityRow& row : kRunQuantityRows) {
      for (std::size_t i = 0; i < size_of(row.shape, plan.gyros); ++i) {
        const double size = row.unit == "rad" ? 1e-5 : row.unit == "rad s-1" ? 2e-9 : row.unit == "s" ? 9000 : 1;
        record[row.quantity].push_back(size * record.draws[0] * (1 + 0.1 * normal(random)));
      }
    }
    record[RunQuantity::kNees] = {nees + 4 * std::clamp(normal(random), -2.0, 2.0)};
    record[RunQuantity::kNeesFreedom] = {20};
    record[RunQuantity::kNisMean] = record[RunQuantity::kNisFreedom] = {4};
    record[RunQuantity::kNisFixes] = {10000};
    record[RunQuantity::kIntervalAfterIsLowerBound] = {run % 4 == 0 ? 1.0 : 0.0};
    if (run % 200 == 199) {
      record[RunQuantity::kDriftSettled] = {std::numeric_limits<double>::quiet_NaN()};
    }
    campaign.records.push_back(std::move(record));
  }
  return campaign;
}

}  // namespace trihedron::report::test
