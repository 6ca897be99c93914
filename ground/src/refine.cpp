#include "refine.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
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

/// Readings at the times of fixes, by the samples round them together.
class SmoothReadings {
 public:
  SmoothReadings(const ScreenedPass& pass, const std::vector<double>& readout_noise_rad)
      : samples_(pass.samples), gyros_(pass.gyros), noise_rad_(readout_noise_rad) {}

  struct At {
    GyroDirections h_b;
    GyrosUsed used{};
    double noise_factor = 1;
  };
  /// By what a fix was compared with where no polynomial is what the body did.
  [[nodiscard]] At at(const ScreenedPass::Fix& fix) const {
    for (const Duration reach : kReaches) {
      if (const auto fitted = fit(fix, reach)) {
        return *fitted;
      }
    }
    return {fix.h_b, fix.used, fix.noise_factor};
  }

 private:
  struct Indexed {
    const std::vector<ScreenedPass::Sample>& samples;
    [[nodiscard]] const ScreenedPass::Sample& operator[](int i) const { return samples[static_cast<std::size_t>(i)]; }
  };

  [[nodiscard]] std::optional<At> fit(const ScreenedPass::Fix& fix, Duration reach) const {
    const Time t = fix.fix.t;
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
          fix.used[k] && std::all_of(first, last, [&](const ScreenedPass::Sample& sample) { return sample.used[k]; });
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

SmoothedCourse smoothed_course(const ScreenedPass& screened, const PassProblem& problem, const BatchResult& result) {
  SmoothedCourse course;
  course.readings.gyros = screened.gyros;
  AttitudeHistory& history = course.attitude;
  const std::vector<MatrixXd> roots = covariance_roots(result.errors, result.linear.stages);
  const SmoothReadings readings(screened, problem.setup().readout_noise_rad);
  problem.go_along(result.solution, [&](const PassProblem::Moment& moment) {
    if (moment.fix == nullptr) {
      return;
    }
    const SmoothReadings::At at = readings.at(*moment.fix);
    const auto attitude = PassProblem::attitude(result.solution, moment, at.h_b, at.used);
    if (!attitude) {
      return;
    }
    const MatrixXd spread =
        problem.attitude_by_states(result.solution, moment, attitude.value(), at.h_b) * roots[moment.arc];
    Matrix3d covariance_rad2 = spread * spread.transpose();
    for (int k = 0; k < screened.gyros; ++k) {
      const double noise_rad = problem.setup().readout_noise_rad[static_cast<std::size_t>(k)] * at.noise_factor;
      const Matrix3d by_direction = attitude.value().by_directions.middleCols<3>(3L * k);
      covariance_rad2 += noise_rad * noise_rad * by_direction * by_direction.transpose();
    }
    history.t.push_back(moment.t);
    history.q_in_c.push_back(attitude.value().C_in_c.quaternion());
    history.sigma_rad.emplace_back(covariance_rad2.diagonal().cwiseSqrt());
    course.readings.t.push_back(moment.t);
    for (int k = 0; k < screened.gyros; ++k) {
      const Vector3d h_b = result.solution.gyros[static_cast<std::size_t>(k)].C_c_b.transpose() *
                           (attitude.value().C_in_c.raw().transpose() * moment.h_in[k]);
      course.readings.h.insert(course.readings.h.end(), h_b.begin(), h_b.end());
    }
  });
  return course;
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
  calibration.statistics["batch_iterations"] = result.iterations;
  calibration.statistics["batch_converged"] = result.converged ? 1 : 0;
  SmoothedCourse course = smoothed_course(screened, problem, result);
  run.drift_models = flown(forecasts, course);
  run.attitude = std::move(course.attitude);
}

}  // namespace trihedron::ground
