#include "trihedron/ground/calibrate/calibrate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <chrono>
#include <cmath>
#include <memory>
#include <utility>

#include "batch/pass_setup.hpp"
#include "batch/refine.hpp"
#include "choose/decide.hpp"
#include "model/gyro_model.hpp"
#include "onboard/setup.hpp"
#include "onboard/with_estimator.hpp"
#include "trihedron/ground/judge/verdict.hpp"
#include "trihedron/ground/model/names.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/onboard/replay.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/records/progress.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {
namespace {

/// Between the paper's corrections.
constexpr Duration kWatchedCorrections = std::chrono::minutes(90);

template <class Report>
FixRecord record_of(const Report& report) {
  FixRecord record;
  record.t = report.fix.t;
  record.head = report.fix.head;
  record.status = report.fix.status;
  for (Eigen::Index row = 0; row < report.fix.innovation.size(); ++row) {
    record.innovation.push_back(report.fix.innovation(row));
    record.innovation_sigma.push_back(std::sqrt(report.fix.innovation_covariance(row, row)));
  }
  record.nis = report.fix.nis;
  record.degrees_of_freedom =
      2 * static_cast<int>(std::count(report.gyros.begin(), report.gyros.end(), GyroState::kUsed));
  record.jumped = report.fix.jumped;
  record.corrected_navigator = report.corrected;
  return record;
}

/// Estimates in the order of state_names().
template <class Estimator>
std::vector<double> parameter_values(const Estimator& estimator) {
  std::vector<double> values;
  for (const auto& gyro : estimator.gyros()) {
    values.insert(values.end(), gyro.drift_rad_s.begin(), gyro.drift_rad_s.begin() + Estimator::BaseModel::kSize);
    const Eigen::Vector3d lambda = Rot<C, B<1>>::assume(gyro.C_c_b).log().raw();
    values.insert(values.end(), lambda.begin(), lambda.end());
  }
  return values;
}

/// Square root of the covariance of the parameters, rows in the order of state_names().
template <class Estimator>
auto parameter_root(const Estimator& estimator) {
  using Base = typename Estimator::BaseModel;
  using Layout = ParameterLayout<Base, Estimator::kGyros>;
  const auto all = estimator.error_root();
  Eigen::Matrix<double, Layout::kSize, Estimator::ErrorRoot::ColsAtCompileTime> root;
  for (int k = 0; k < Estimator::kGyros; ++k) {
    root.template middleRows<Base::kSize>(Layout::drift(k)) =
        all.template middleRows<Base::kSize>(Estimator::Errors::drift(k));
    root.template middleRows<3>(Layout::alignment(k)) = all.template middleRows<3>(Estimator::Errors::alignment(k));
  }
  return root;
}

/// Squared distance of the estimates from the prior means, in prior sigmas.
template <class Estimator>
double misfit(const Estimator& estimator) {
  using Layout = typename Estimator::Setup::Layout;
  Eigen::Matrix<double, Layout::kSize, 1> moved;
  for (int k = 0; k < Estimator::kGyros; ++k) {
    const auto& held = estimator.setup().prior[k];
    const auto& estimate = estimator.gyros()[k];
    constexpr int kSize = Estimator::BaseModel::kSize;
    moved.template segment<kSize>(Layout::drift(k)) =
        estimate.drift_rad_s.template head<kSize>() - held.drift_rad_s.template head<kSize>();
    moved.template segment<3>(Layout::alignment(k)) =
        Rot<C, C>::assume(Eigen::Matrix3d(estimate.C_c_b * held.C_c_b.transpose())).log().raw();
  }
  return moved.dot(estimator.setup().prior_covariance.llt().solve(moved));
}

void append(AttitudeHistory& history, Time t, const AttitudeSolution& solution) {
  history.t.push_back(t);
  history.q_in_c.push_back(solution.C_in_c.quaternion());
  history.sigma_rad.emplace_back(solution.covariance_rad2.diagonal().cwiseSqrt());
}

/// Reports progress about a hundred times over a pass.
class Meter {
 public:
  Meter(const Progress& progress, std::size_t steps)
      : progress_(progress), steps_(steps), every_(std::max<std::size_t>(steps / 100, 1)) {}
  void step() {
    if (++done_ % every_ == 0 && progress_) {
      progress_(static_cast<double>(done_) / static_cast<double>(steps_));
    }
  }

 private:
  const Progress& progress_;
  std::size_t steps_;
  std::size_t every_;
  std::size_t done_ = 0;
};

/// So many fixes off in a row, by more than drift can make, are not single outliers.
constexpr double kLie = 20;

std::map<std::string, double> statistics_of(const std::vector<FixRecord>& fixes) {
  double nis_sum = 0;
  double count = 0;
  double used = 0;
  double outliers = 0;
  double reopened = 0;
  double in_a_row = 0;
  double jumped = 0;
  double freedom = 0;
  std::vector<double> squares(fixes.empty() ? 0 : fixes.front().innovation.size());
  for (const FixRecord& fix : fixes) {
    used += fix.used() ? 1 : 0;
    outliers += fix.status == FixStatus::kRejectedByGate ? 1 : 0;
    const bool was_reopened = fix.status == FixStatus::kUsedAfterReopening || fix.status == FixStatus::kRestarted;
    reopened += was_reopened ? 1 : 0;
    in_a_row = fix.jumped ? in_a_row + 1 : 0;
    jumped += in_a_row == kLie ? kLie : in_a_row > kLie ? 1 : 0;
    if (fix.status == FixStatus::kUsed) {
      nis_sum += fix.nis;
      freedom += fix.degrees_of_freedom;
      ++count;
      for (std::size_t i = 0; i < squares.size(); ++i) {
        squares[i] += std::pow(fix.innovation[i], 2);
      }
    }
  }
  std::map<std::string, double> statistics{{"fixes", static_cast<double>(fixes.size())},
                                           {"fixes_used", used},
                                           {"fixes_rejected_as_outliers", outliers},
                                           {"reopened", reopened},
                                           {"fixes_off_in_a_row", jumped},
                                           {"nis_count", count},
                                           {"nis_degrees_of_freedom", count > 0 ? freedom / count : 0}};
  if (count > 0) {
    statistics["nis_mean"] = nis_sum / count;
    for (std::size_t i = 0; i < squares.size(); ++i) {
      statistics[fmt::format("innovation_{}_rms_rad", i + 1)] = std::sqrt(squares[i] / count);
    }
  }
  return statistics;
}

/// No fix started the filter: says what became of them.
SetupError nothing_used(const std::vector<FixRecord>& fixes) {
  std::map<std::string, long> counts;
  for (const FixRecord& fix : fixes) {
    ++counts[name_of(fix.status)];
  }
  std::string what_became;
  for (const auto& [name, count] : counts) {
    what_became += fmt::format("{}{} {}", what_became.empty() ? "" : ", ", count, name);
  }
  return {fmt::format("no fix could be used to start from ({})", what_became.empty() ? "there is none" : what_became),
          "look at the telemetry with `trihedron inspect`"};
}

/// Keeps the extremes of z1 over each stretch of 3 s.
class AngleTrack {
 public:
  explicit AngleTrack(CalibrationRun& run) : run_(run) {}
  void add(Time t, double residual) {
    if (run_.angle_t.empty() || t - run_.angle_t.back() >= std::chrono::seconds(3)) {
      run_.angle_t.push_back(t);
      run_.angle_residual_min.push_back(residual);
      run_.angle_residual_max.push_back(residual);
      return;
    }
    run_.angle_residual_min.back() = std::min(run_.angle_residual_min.back(), residual);
    run_.angle_residual_max.back() = std::max(run_.angle_residual_max.back(), residual);
  }

 private:
  CalibrationRun& run_;
};

/// The further states that are on, but for wandering drift.
template <class Estimator>
std::vector<FurtherEstimate> further_of(const Estimator& estimator, const FurtherStateOptions& states,
                                        int further_heads) {
  std::vector<FurtherEstimate> further;
  if constexpr (requires { estimator.shared(); }) {
    if constexpr (Estimator::kFurther.shared() > 0) {
      using Layout = typename Estimator::Layout;
      const auto root = estimator.information().inverse_root();
      const std::vector<std::string> names = further_names(states, further_heads, Estimator::kGyros);
      const auto tell = [&](double value, int state) {
        further.push_back({names[further.size()], value, root.row(state).norm()});
      };
      const auto tell_shared = [&](int first, int size) {
        for (int state = first; state < first + size; ++state) {
          tell(estimator.shared()(state - Layout::kShared), state);
        }
      };
      constexpr auto kOn = FurtherStateOptions::Choice::kOn;
      tell_shared(Layout::clock_offset(), states.clock_offset == kOn ? 1 : 0);
      tell_shared(Layout::orbital_error(), states.orbital_error == kOn ? 6 : 0);
      tell_shared(Layout::head(1), 3 * further_heads);
      if (states.readout_bias == kOn) {
        for (int k = 0; k < Estimator::kGyros; ++k) {
          for (int i = 0; i < 3; ++i) {
            tell(estimator.gyros()[k].readout_bias(i), Layout::readout_bias(k) + i);
          }
        }
      }
    }
  }
  return further;
}

/// The prior as a calibration: values and covariance.
Calibration known_before(const Pass& pass, int gyros, const CalibrationOptions& options) {
  const DriftFamily family = family_of(options.drift_model);
  const ParameterPrior prior = prior_of(pass.settings, gyros, family);
  Calibration before;
  before.estimator = options.estimator;
  before.epoch = before.t = pass.settings.epoch;
  for (const GyroParameters& gyro : prior.gyros) {
    before.gyros.push_back(record_of(gyro, options.drift_model, family));
  }
  before.states = state_names(family, gyros);
  before.covariance = prior.covariance;
  return before;
}

template <class Estimator>
Calibration result_of(const Pass& pass, const Cycle<Estimator>& cycle, const CalibrationOptions& options) {
  using Model = typename Estimator::BaseModel;
  Calibration result;
  result.estimator = Estimator::kName;
  result.epoch = pass.settings.epoch;
  result.t = cycle.t();
  for (const auto& gyro : cycle.estimator().gyros()) {
    result.gyros.push_back(to_record<Model>(gyro));
  }
  const FurtherStateOptions& states = options.further_states;
  result.further = further_of(cycle.estimator(), states, further_heads<Estimator>(pass));
  result.noise = CalibrationNoise{options.direction_random_walk_rad_sqrt_s, options.star_tracker_noise_rad};
  if (states.wandering_drift == FurtherStateOptions::Choice::kOn) {
    result.noise->wandering_drift_rad_s = states.wandering_drift_rad_s;
    result.noise->wandering_time_s = to_seconds(states.wandering_time);
  }
  result.states = state_names(DriftFamily::of<Model>(), Estimator::kGyros);
  const auto root = parameter_root(cycle.estimator());
  result.covariance = root * root.transpose();
  return result;
}

template <class Estimator>
Correction correction_of(const Estimator& estimator, const AttitudeSolution& attitude, Time t) {
  Correction correction;
  correction.t = t;
  const Eigen::Matrix3d& C_in_c = attitude.C_in_c.raw();
  for (int k = 0; k < Estimator::kGyros; ++k) {
    const auto& calibrated = estimator.gyros()[k];
    auto before = estimator.prior_gyros()[k];
    // Where the momentum is in the case, seen through what was known of it before.
    before.h_in = C_in_c * before.in_c(calibrated.C_c_b.transpose() * (C_in_c.transpose() * calibrated.h_in) +
                                       calibrated.readout_bias);
    correction.known_before.push_back(to_record<typename Estimator::BaseModel>(before));
    correction.calibrated.push_back(to_record<typename Estimator::BaseModel>(calibrated));
  }
  return correction;
}

template <class Estimator>
CalibrationRun calibrate_with(const Pass& pass, Decision decision, const Progress& progress) {
  const auto cycle = make_cycle<Estimator>(pass, decision.options, policy_of(decision.options.corrections));
  CalibrationRun run;
  run.options = std::move(decision.options);
  run.evidence = std::move(decision.evidence);
  AngleTrack angle(run);
  Time corrected{};
  decltype(Cycle<Estimator>::Report::gyros) gyros_before{};
  double angle_looks = 0;
  std::optional<Refinement> refinement;
  std::vector<DriftModelForecast> drift_models;
  const auto refine = [&, setup = pass_setup<Estimator>(cycle->estimator().setup(), pass, run.options)] {
    if (!decision.screened) {
      decision.screened = screen(pass, run.options);
    }
    refinement.emplace(*decision.screened, setup, run.options);
    drift_models = flown(decision.forecasts, refinement->course());
  };
  const auto on_fix = [&](const typename Cycle<Estimator>::Report& report) {
    run.fixes.push_back(record_of(report));
    corrected = report.corrected ? report.fix.t : corrected;
    if (report.fix.used() &&
        (run.parameters.t.empty() || report.fix.t - run.parameters.t.back() >= ParameterHistory::kStep)) {
      run.parameters.t.push_back(report.fix.t);
      run.parameters.value.push_back(parameter_values(cycle->estimator()));
      const auto root = parameter_root(cycle->estimator());
      std::vector<double>& sigma = run.parameters.sigma.emplace_back();
      for (Eigen::Index row = 0; row < root.rows(); ++row) {
        sigma.push_back(root.row(row).norm());
      }
    }
    if (report.fix.used() && report.calibrated &&
        (run.corrections.empty() || report.fix.t - run.corrections.back().t >= kWatchedCorrections)) {
      run.corrections.push_back(correction_of(cycle->estimator(), *report.calibrated, report.fix.t));
    }
    if (report.calibrated) {
      append(run.attitude, report.fix.t, *report.calibrated);
    }
    if (report.navigated) {
      append(run.navigation, report.fix.t, *report.navigated);
      run.navigation.age_s.push_back(to_seconds(report.fix.t - corrected));
    }
  };
  std::array<long, kSampleStatuses> samples{};
  Meter meter(progress, pass.gyro.size());
  const auto on_sample = [&](const typename Cycle<Estimator>::Report& report) {
    ++samples[static_cast<std::size_t>(report.sample)];
    for (int k = 0; k < Estimator::kGyros; ++k) {
      if (report.gyros[k] != gyros_before[k]) {
        run.gyro_events.push_back({report.t, k, report.gyros[k]});
      }
    }
    gyros_before = report.gyros;
    angle_looks += is_used(report.angles.status) ? 1 : 0;
    if (report.fixes_dropped > 0) {
      run.fix_counts["rejected: clock set back while it waited"] += report.fixes_dropped;
    }
    if (cycle->estimator().started() && report.sample == SampleStatus::kUsed) {
      angle.add(report.t, report.angle_residual);
    }
    meter.step();
  };
  const auto on_board = [&] {
    replay(pass, *cycle, on_fix, on_sample);
    if (!cycle->estimator().started()) {
      throw nothing_used(run.fixes);
    }
  };
  if (run.options.estimator == kBatch) {
    side_by_side(on_board, refine);
  } else {
    on_board();
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i] > 0) {
      run.samples[name_of(static_cast<SampleStatus>(i))] = samples[i];
    }
  }
  run.known_before = known_before(pass, Estimator::kGyros, run.options);
  run.calibration = result_of(pass, *cycle, run.options);
  if (refinement) {
    run.drift_models = std::move(drift_models);
    std::move(*refinement).put_into(run);
  }
  for (const FixRecord& fix : run.fixes) {
    ++run.fix_counts[name_of(fix.status)];
  }
  run.calibration.statistics.merge(statistics_of(run.fixes));
  run.calibration.statistics["angle_looks"] = angle_looks;
  run.calibration.verdict = judge(pass, run);
  return run;
}

template <class Estimator>
NavigationRun navigate_with(const Pass& pass, const CalibrationOptions& options, const Progress& progress) {
  const auto cycle = make_cycle<Estimator>(pass, options, policy_of(options.corrections));
  NavigationRun run;
  Time corrected{};
  Meter meter(progress, pass.gyro.size());
  replay(
      pass, *cycle,
      [&](const typename Cycle<Estimator>::Report& report) {
        run.fixes.push_back(record_of(report));
        corrected = report.corrected ? report.fix.t : corrected;
      },
      [&](const typename Cycle<Estimator>::Report& report) {
        meter.step();
        if (report.sample != SampleStatus::kUsed || !cycle->navigator().started()) {
          return;
        }
        if (const auto solution = cycle->navigation_attitude()) {
          append(run.attitude, report.t, solution.value());
          run.attitude.age_s.push_back(to_seconds(report.t - corrected));
        }
      });
  if (run.attitude.t.empty()) {
    throw nothing_used(run.fixes);
  }
  run.statistics = statistics_of(run.fixes);
  if (!options.corrections.take_parameters) {
    run.held_parameters_misfit = misfit(cycle->estimator());
    run.misfit_limit = boost::math::quantile(boost::math::chi_squared(Estimator::Setup::Layout::kSize), 0.999);
  }
  run.verdict = judge_navigation(run);
  return run;
}

}  // namespace

CalibrationRun calibrate(const Pass& pass, const CalibrationOptions& options, const Progress& progress) {
  Decision decision = decide(pass, options);
  return with_estimator(pass, decision.options, [&]<class Estimator> {
    return calibrate_with<Estimator>(pass, std::move(decision), progress);
  });
}

NavigationRun navigate(const Pass& pass, const CalibrationOptions& options, const Progress& progress) {
  const CalibrationOptions decided = decide(pass, options).options;
  if (is_for_whole_pass(decided.drift_model)) {
    throw SetupError(fmt::format("the navigator on board has no drift model '{}'", decided.drift_model),
                     "navigate by a calibration with --drift-model esg20, or take the attitude that calibrate "
                     "--definitive writes");
  }
  return with_estimator(pass, decided,
                        [&]<class Estimator> { return navigate_with<Estimator>(pass, decided, progress); });
}

}  // namespace trihedron::ground
