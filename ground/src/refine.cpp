#include "refine.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "batch.hpp"
#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/optimal_attitude.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

/// The body moves like a cubic over some seconds to both sides; where it does not, over less.
constexpr std::array<Duration, 3> kReaches = {std::chrono::milliseconds(3000), std::chrono::milliseconds(1400),
                                              std::chrono::milliseconds(700)};

/// Readings at any time, by the samples round it together.
class SmoothReadings {
 public:
  SmoothReadings(const ScreenedPass& pass, const std::vector<double>& readout_noise_rad)
      : samples_(pass.samples), gyros_(pass.gyros), noise_rad_(readout_noise_rad) {}

  struct At {
    GyroDirections h_b;
    GyrosUsed used{};
    double noise_factor = 1;
  };
  /// `otherwise` where no polynomial is what the body did; of the gyros that it uses.
  [[nodiscard]] At at(Time t, const At& otherwise) const {
    for (const Duration reach : kReaches) {
      if (const auto fitted = fit(t, otherwise.used, reach)) {
        return *fitted;
      }
    }
    return otherwise;
  }

 private:
  struct Indexed {
    const std::vector<ScreenedPass::Sample>& samples;
    [[nodiscard]] const ScreenedPass::Sample& operator[](int i) const { return samples[static_cast<std::size_t>(i)]; }
  };

  [[nodiscard]] std::optional<At> fit(Time t, const GyrosUsed& used, Duration reach) const {
    constexpr int kDegree = 3;
    constexpr int kLeast = 2 * (kDegree + 1);
    const auto before = [](const ScreenedPass::Sample& sample, Time time) { return sample.t < time; };
    const auto first = std::lower_bound(samples_.begin(), samples_.end(), t - reach, before);
    const auto last = std::lower_bound(first, samples_.end(), t + reach + Duration{1}, before);
    const auto begin = static_cast<int>(first - samples_.begin());
    const auto end = static_cast<int>(last - samples_.begin());
    if (end - begin < kLeast) {
      return std::nullopt;
    }
    const auto gap = std::adjacent_find(first, last, [](const auto& a, const auto& b) {
      return b.t - a.t > Cycle<InvariantEstimator<Esg7, 2>>::kMaxInterpolation;
    });
    if (gap != last) {
      return std::nullopt;
    }
    const auto fitted = fit_directions<kMaxGyros>(Indexed{samples_}, begin, end, t, kDegree);
    const double bound = fitted.freedom + 5 * std::sqrt(2.0 * fitted.freedom);
    At at;
    at.h_b = fitted.h_b;
    at.noise_factor = fitted.noise_factor;
    for (int k = 0; k < gyros_; ++k) {
      const double sigma_rad = noise_rad_[static_cast<std::size_t>(k)];
      at.used[k] =
          used[k] && std::all_of(first, last, [&](const ScreenedPass::Sample& sample) { return sample.used[k]; });
      if (at.used[k] && !(fitted.residual_square[k] <= bound * sigma_rad * sigma_rad)) {
        return std::nullopt;
      }
    }
    return count(at.used) >= 2 ? std::optional(at) : std::nullopt;
  }

  const std::vector<ScreenedPass::Sample>& samples_;
  int gyros_;
  const std::vector<double>& noise_rad_;
};

/// Attitude by the smoothed momenta.
class SmoothedAttitude {
 public:
  /// `roots`: of the covariance, arc by arc. Refers to all of them.
  SmoothedAttitude(const ScreenedPass& screened, const PassProblem& problem, const PassSolution& solution,
                   const std::vector<MatrixXd>& roots)
      : problem_(problem), solution_(solution), roots_(roots), readings_(screened, problem.setup().readout_noise_rad) {}

  struct At {
    Rot<In, C> C_in_c;
    Vector3d sigma_rad;
  };
  /// `otherwise` as of SmoothReadings. Nothing where the directions give no attitude.
  [[nodiscard]] std::optional<At> at(const PassProblem::Moment& moment, const SmoothReadings::At& otherwise) const {
    const SmoothReadings::At reading = readings_.at(moment.t, otherwise);
    const auto attitude = PassProblem::attitude(solution_, moment, reading.h_b, reading.used);
    if (!attitude) {
      return std::nullopt;
    }
    const MatrixXd spread =
        problem_.attitude_by_states(solution_, moment, attitude.value(), reading.h_b) * roots_[moment.arc];
    Vector3d variance_rad2 = spread.rowwise().squaredNorm();
    for (int k = 0; k < problem_.setup().layout.gyros; ++k) {
      const double noise_rad = problem_.setup().readout_noise_rad[static_cast<std::size_t>(k)] * reading.noise_factor;
      variance_rad2 +=
          noise_rad * noise_rad * attitude.value().by_directions.middleCols<3>(3L * k).rowwise().squaredNorm();
    }
    return At{attitude.value().C_in_c, variance_rad2.cwiseSqrt()};
  }

 private:
  const PassProblem& problem_;
  const PassSolution& solution_;
  const std::vector<MatrixXd>& roots_;
  SmoothReadings readings_;
};

void append(const SmoothedAttitude::At& attitude, Time t, AttitudeHistory& history) {
  history.t.push_back(t);
  history.q_in_c.push_back(attitude.C_in_c.quaternion());
  history.sigma_rad.push_back(attitude.sigma_rad);
}

SmoothedCourse smoothed_course(const PassProblem& problem, const PassSolution& solution,
                               const SmoothedAttitude& smoothed) {
  SmoothedCourse course;
  const int gyros = problem.setup().layout.gyros;
  course.readings.gyros = gyros;
  problem.go_along(solution, [&](const PassProblem::Moment& moment) {
    if (moment.fix == nullptr) {
      return;
    }
    const auto attitude = smoothed.at(moment, {moment.fix->h_b, moment.fix->used, moment.fix->noise_factor});
    if (!attitude) {
      return;
    }
    append(*attitude, moment.t, course.attitude);
    course.readings.t.push_back(moment.t);
    for (int k = 0; k < gyros; ++k) {
      const Vector3d h_b = solution.gyros[static_cast<std::size_t>(k)].C_c_b.transpose() *
                           (attitude->C_in_c.raw().transpose() * moment.h_in[k]);
      course.readings.h.insert(course.readings.h.end(), h_b.begin(), h_b.end());
    }
  });
  return course;
}

/// At each gyro sample from the first fix on.
AttitudeHistory definitive_attitude(const ScreenedPass& screened, const PassProblem& problem,
                                    const PassSolution& solution, const SmoothedAttitude& smoothed) {
  AttitudeHistory history;
  auto sample = std::ranges::lower_bound(screened.samples, problem.begin_of(0), {}, &ScreenedPass::Sample::t);
  std::optional<PassProblem::Moment> before;
  problem.go_along(solution, [&](const PassProblem::Moment& moment) {
    PassProblem::Moment between = moment;
    for (; sample != screened.samples.end() && sample->t <= moment.t; ++sample) {
      between.t = sample->t;
      // From node to node a momentum turns by a fraction of an arcsecond.
      for (int k = 0; before && k < screened.gyros; ++k) {
        const double part = to_seconds(sample->t - before->t) / to_seconds(moment.t - before->t);
        between.h_in[k] = (before->h_in[k] + part * (moment.h_in[k] - before->h_in[k])).normalized();
      }
      if (const auto attitude = smoothed.at(between, {sample->h_b, sample->used, 1})) {
        append(*attitude, sample->t, history);
      }
    }
    before = moment;
  });
  return history;
}

/// What is left of each fix when the whole pass is smoothed, in place of what it was off on board.
void use_residuals(const PassProblem& problem, const PassSolution& solution, const std::vector<MatrixXd>& roots,
                   std::vector<FixRecord>& fixes) {
  std::map<std::pair<Time, int>, FixRecord*> compared;
  for (FixRecord& fix : fixes) {
    if (fix.used() || fix.status == FixStatus::kRejectedByGate) {
      compared[{fix.t, fix.head}] = &fix;
    }
  }
  problem.go_along(solution, [&](const PassProblem::Moment& moment) {
    const auto found = moment.fix == nullptr ? compared.end() : compared.find({moment.t, moment.fix->fix.head});
    if (found == compared.end()) {
      return;
    }
    const PassProblem::FixRows rows = problem.compare(solution, moment);
    if (rows.y.size() == 0) {
      return;
    }
    FixRecord& fix = *found->second;
    MatrixXd covariance = rows.R;
    fix.status = FixStatus::kRejectedByGate;
    if (!problem.is_outlier(rows)) {
      fix.status = FixStatus::kUsed;
      const MatrixXd spread = rows.H * roots[moment.arc];
      covariance -= spread * spread.transpose();
    }
    fix.nis = rows.y.dot(covariance.ldlt().solve(rows.y));
    fix.degrees_of_freedom = static_cast<int>(rows.y.size());
    std::fill(fix.innovation.begin(), fix.innovation.end(), 0);
    std::fill(fix.innovation_sigma.begin(), fix.innovation_sigma.end(), 0);
    Eigen::Index row = 0;
    for (int k = 0; k < problem.setup().layout.gyros; ++k) {
      for (int i = 2 * k; moment.fix->used[k] && i < 2 * k + 2; ++i, ++row) {
        fix.innovation[static_cast<std::size_t>(i)] = rows.y(row);
        fix.innovation_sigma[static_cast<std::size_t>(i)] = std::sqrt(covariance(row, row));
      }
    }
  });
}

/// How far the constants by the first half of the pass are off those by all of it: their difference has the covariance
/// by which the second half makes them better known. Only what it halves at least counts.
void compare_halves(const BatchResult& result, const PassLayout& layout, std::map<std::string, double>& statistics) {
  constexpr double kLeast = 0.5;
  const PassProblem::Linear& linear = result.linear;
  const std::size_t half = linear.stages.size() / 2;
  if (half == 0) {
    return;
  }
  const Eigen::Index c = layout.constants();
  const MatrixXd triangle = triangles_after(linear.prior, linear.prior_y, linear.stages, {half - 1}).front();
  const auto R = triangle.block(layout.dynamic(), layout.dynamic(), c, c).triangularView<Eigen::Upper>();
  // In units of what is known after the first half: the whole has covariance `rest` there.
  const Eigen::VectorXd first = triangle.block(layout.dynamic(), layout.size(), c, 1);
  const MatrixXd known = R * MatrixXd(result.errors.last_root.bottomRows(c));
  const Eigen::VectorXd whole = R * Eigen::VectorXd(result.errors.x.back().tail(c));
  const Eigen::SelfAdjointEigenSolver<MatrixXd> rest(known * known.transpose());
  double square = 0;
  int freedom = 0;
  for (Eigen::Index i = 0; i < c; ++i) {
    const double gained = 1 - rest.eigenvalues()(i);
    if (gained > kLeast) {
      const double off = rest.eigenvectors().col(i).dot(first - whole);
      square += off * off / gained;
      ++freedom;
    }
  }
  statistics["halves_chi_square"] = square;
  statistics["halves_degrees_of_freedom"] = freedom;
}

/// Columns of `to` in place of those of `from`. What was not estimated along the pass is not a number there, with the
/// sigma of before the pass.
void rearrange(const std::vector<std::string>& from, const std::vector<std::string>& to, const PassSetup& setup,
               ParameterHistory& history) {
  const Eigen::VectorXd prior_sigma = setup.prior.covariance.diagonal().cwiseSqrt();
  ParameterHistory rearranged{history.t, {}, {}};
  for (std::size_t row = 0; row < history.t.size(); ++row) {
    std::vector<double>& value = rearranged.value.emplace_back(to.size(), std::nan(""));
    std::vector<double>& sigma = rearranged.sigma.emplace_back(prior_sigma.begin(), prior_sigma.end());
    for (std::size_t column = 0; column < to.size(); ++column) {
      const auto found = std::find(from.begin(), from.end(), to[column]) - from.begin();
      if (const auto i = static_cast<std::size_t>(found); i < from.size()) {
        value[column] = history.value[row][i];
        sigma[column] = history.sigma[row][i];
      }
    }
  }
  history = std::move(rearranged);
}

std::vector<FurtherEstimate> further_of(const PassSetup& setup, const BatchResult& result,
                                        const std::vector<std::string>& names) {
  const PassLayout& layout = setup.layout;
  const MatrixXd& root = result.errors.last_root;
  std::vector<FurtherEstimate> further;
  const auto tell = [&](double value, int state) {
    further.push_back({names[further.size()], value, root.row(state).norm()});
  };
  for (int i = layout.shared(); i < layout.size(); ++i) {
    tell(result.solution.shared(i - layout.shared()), i);
  }
  if (layout.readout_bias) {
    for (int k = 0; k < layout.gyros; ++k) {
      for (int i = 0; i < 3; ++i) {
        tell(result.solution.gyros[static_cast<std::size_t>(k)].readout_bias(i), layout.bias(k) + i);
      }
    }
  }
  if (layout.coefficient_change) {
    for (int k = 0; k < layout.gyros; ++k) {
      for (int i = 0; i < Esg7::kSize; ++i) {
        tell(result.solution.gyros[static_cast<std::size_t>(k)].change_rad_s(i), layout.change(k) + i);
      }
    }
  }
  return further;
}

}  // namespace

std::vector<std::string> further_names(const FurtherStateOptions& states, int further_heads, int gyros) {
  constexpr auto kOn = FurtherStateOptions::Choice::kOn;
  std::vector<std::string> names;
  if (states.clock_offset == kOn) {
    names.emplace_back("clock_offset_s");
  }
  if (states.orbital_error == kOn) {
    for (const char* wave : {"sine", "cosine"}) {
      for (const char axis : {'x', 'y', 'z'}) {
        names.push_back(fmt::format("orbital_{}_{}_rad", wave, axis));
      }
    }
  }
  for (int head = 1; head <= further_heads; ++head) {
    for (const char axis : {'x', 'y', 'z'}) {
      names.push_back(fmt::format("star_tracker_{}_align_{}_rad", head + 1, axis));
    }
  }
  if (states.readout_bias == kOn) {
    for (int k = 1; k <= gyros; ++k) {
      for (const char axis : {'x', 'y', 'z'}) {
        names.push_back(fmt::format("gyro{}_readout_bias_{}_rad", k, axis));
      }
    }
  }
  if (states.coefficient_change == kOn) {
    for (int k = 1; k <= gyros; ++k) {
      for (const char* coefficient : Esg7::kNames) {
        names.push_back(fmt::format("gyro{}_{}_change_rad_s", k, coefficient));
      }
    }
  }
  return names;
}

void refine(const ScreenedPass& screened, const PassSetup& setup, const std::vector<Forecast>& forecasts,
            CalibrationRun& run) {
  if (screened.clock_set_back) {
    throw SetupError("the clock of the telemetry was set back within the pass: how its parts lie in time is unknown",
                     "calibrate the parts apart, or use estimator invariant");
  }
  const PassProblem problem(screened, setup);
  Calibration& calibration = run.calibration;
  std::vector<GyroParameters> first;
  for (const GyroCalibration& gyro : calibration.gyros) {
    first.push_back(parameters_of(gyro, setup.family));
  }
  BatchResult result = most_likely(problem, problem.start(first));

  const PassLayout& layout = setup.layout;
  const MatrixXd own =
      result.errors.last_root.middleRows(layout.drift(0), layout.drift(layout.gyros) - layout.drift(0));
  calibration.covariance = own * own.transpose();
  GyroDirections last_h_in;
  problem.go_along(result.solution, [&](const PassProblem::Moment& moment) {
    calibration.t = moment.t;
    last_h_in = moment.h_in;
  });
  for (int k = 0; k < layout.gyros; ++k) {
    const auto index = static_cast<std::size_t>(k);
    const GyroParameters& found = result.solution.gyros[index];
    GyroCalibration& gyro = calibration.gyros[index];
    gyro = record_of(found, run.options.drift_model, setup.family);
    gyro.momentum_in = last_h_in[k];
  }
  calibration.estimator = kBatch;
  const std::vector<std::string> states = state_names(setup.family, layout.gyros);
  rearrange(calibration.states, states, setup, run.parameters);
  calibration.states = states;
  calibration.further =
      further_of(setup, result, further_names(run.options.further_states, layout.further_heads, layout.gyros));
  compare_halves(result, layout, calibration.statistics);
  calibration.statistics["batch_iterations"] = result.iterations;
  calibration.statistics["batch_converged"] = result.converged ? 1 : 0;
  const std::vector<MatrixXd> roots = covariance_roots(result.errors, result.linear.stages);
  use_residuals(problem, result.solution, roots, run.fixes);
  const SmoothedAttitude smoothed(screened, problem, result.solution, roots);
  SmoothedCourse course = smoothed_course(problem, result.solution, smoothed);
  run.drift_models = flown(forecasts, course);
  run.attitude = std::move(course.attitude);
  if (run.options.definitive_attitude) {
    run.definitive_attitude = definitive_attitude(screened, problem, result.solution, smoothed);
  }
}

}  // namespace trihedron::ground
