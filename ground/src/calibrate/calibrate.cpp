#include "trihedron/ground/calibrate/calibrate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "batch/left_out_walk.hpp"
#include "batch/pass_setup.hpp"
#include "batch/refine.hpp"
#include "calibrate/beside_outages.hpp"
#include "calibrate/bursts.hpp"
#include "calibrate/calibrate_after.hpp"
#include "calibrate/contradicted_fixes.hpp"
#include "calibrate/corrected_pass.hpp"
#include "calibrate/correlated_fixes.hpp"
#include "calibrate/readout_noise.hpp"
#include "choose/decide.hpp"
#include "judge/changes.hpp"
#include "model/drift_on_board.hpp"
#include "model/nothing_used.hpp"
#include "model/prior.hpp"
#include "model/setup.hpp"
#include "trihedron/ground/clocks/clocks.hpp"
#include "trihedron/ground/clocks/regular_stamps.hpp"
#include "trihedron/ground/evaluate/convergence.hpp"
#include "trihedron/ground/evaluate/open_loop_forecast.hpp"
#include "trihedron/ground/judge/verdict.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/ground/onboard/recorder.hpp"
#include "trihedron/ground/onboard/replay.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/records/progress.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {
namespace {

/// Reports progress about a hundred times over the estimation of a pass.
class ProgressMeter {
 public:
  static constexpr std::string_view kDoing = "estimates";
  ProgressMeter(const Progress& progress, std::size_t steps)
      : progress_(progress), steps_(steps), every_(std::max<std::size_t>(steps / 100, 1)) {}
  void step(const StepReport& report) {
    if (report.sample == SampleStatus::kNone) {
      return;
    }
    if (++done_ % every_ == 0 && progress_) {
      progress_(kDoing, static_cast<double>(done_) / static_cast<double>(steps_));
    }
  }

 private:
  const Progress& progress_;
  std::size_t steps_;
  std::size_t every_;
  std::size_t done_ = 0;
};

/// With the variances of the members of a drift field that the pass has determined.
Prior prior_by(const PassSettings& settings, const Layout& layout, const std::optional<FieldPrior>& field) {
  Prior prior = prior_of(settings, layout);
  if (field) {
    put_sigma(layout, FieldMembers(layout), field->sigma_rad_s, prior);
  }
  return prior;
}

/// The prior as a calibration: values and covariance.
Calibration known_before(const PassSettings& settings, const CalibrationOptions& options,
                         const std::optional<FieldPrior>& field) {
  const CalibrationSetup setup = setup_of(settings, options);
  const Layout& layout = setup.layout;
  const Prior prior = prior_by(settings, layout, field);
  Calibration before;
  before.estimator = options.estimator;
  before.epoch = before.t = settings.epoch;
  for (int k = 0; k < layout.gyros; ++k) {
    before.gyros.push_back(record_of(prior.gyros[k], k, setup, 0));
    before.gyros.back().momentum_in.setZero();
  }
  before.states = drift_and_alignment(layout.drift_model, static_cast<std::size_t>(layout.gyros));
  before.covariance = prior.covariance.topLeftCorner(layout.parameters(), layout.parameters());
  return before;
}

/// Of the calibration; members of the drift that were left out have nothing in common with what was estimated.
Eigen::MatrixXd amplitude_covariance(const CalibrationRun& run) {
  const Layout& layout = run.errors.layout;
  const int size = layout.amplitudes_size();
  if (!run.errors.is_known() || size == 0) {
    return {};
  }
  const std::vector<ParameterId> own = drift_and_alignment(layout.drift_model, static_cast<std::size_t>(layout.gyros));
  const std::vector<ParameterId>& states = run.calibration.states;
  const auto rows = run.errors.covariance.middleRows(layout.amplitudes(), size);
  Eigen::MatrixXd found = Eigen::MatrixXd::Zero(size, std::ssize(states) + size);
  for (std::size_t i = 0; i < own.size(); ++i) {
    const auto column = std::ranges::find(states, own[i]) - states.begin();
    found.col(column) = rows.col(layout.drift(0) + static_cast<Eigen::Index>(i));
  }
  found.rightCols(size) = rows.middleCols(layout.amplitudes(), size);
  return found;
}

/// Options of the on-board run at the time of the batch: without what only a whole pass shows, and with esg20 in place
/// of a larger drift model, or eq. (1) where the pass gives no evidence of more.
CalibrationOptions options_of_on_board_run(const PassSettings& settings, const Decision& decision) {
  CalibrationOptions options = decision.options;
  options.estimator = Estimator::kInvariant;
  options.further_states[FurtherState::kCoefficientChange] = FurtherStateOptions::Choice::kOff;
  if (settings.prior && options.drift_field) {
    options.drift_model.reset();
    use_on_board(*settings.prior, options);
  }
  options.drift_field = false;
  if (options.drift_model && options.drift_model->family == DriftModelId::Family::kVsh && !settings.prior) {
    const bool no_more_than_eq1 = decision.field && decision.field->log_evidence <= kLogOddsToAccept;
    options.drift_model = no_more_than_eq1 ? kEsg7 : kEsg20;
  }
  return options;
}

/// The batch, and the open-loop errors of the drift models that were compared.
struct Smoothed {
  Refinement refinement;
  std::vector<DriftModelForecast> drift_models;
};

/// `decision` keeps the screened pass, to which the result refers.
Smoothed smooth(const Pass& pass, Decision& decision) {
  if (!decision.screened) {
    decision.screened = screen(pass, decision.options);
  }
  PassSetup setup = pass_setup(pass.settings, decision.options);
  setup.prior = prior_by(pass.settings, setup.layout(), decision.field);
  Refinement refinement(*decision.screened, std::move(setup), decision.options, decision.field, decision.nearby);
  std::vector<DriftModelForecast> drift_models = flown(decision.forecasts, refinement.course());
  return {std::move(refinement), std::move(drift_models)};
}

/// With the calibrated parameters from the last sample of the pass on, at `end`; nothing where there is no pair then.
std::optional<OpenLoopForecast> forecast_of(const CalibrationRun& run, Time end) {
  if (run.attitude.size() == 0 ||
      !has_pair_at_end(run.gyro_events, static_cast<int>(run.calibration.gyros.size()), end)) {
    return std::nullopt;
  }
  const BodyMotion motion(run.attitude.t, run.attitude.q_in_c);
  return forecast(run.errors, run.calibration.gyros, motion, attitude_rule_of(run.calibration.estimator),
                  run.options.need);
}

/// What a correction has just taken over; nothing where the next one takes over as much in no time.
std::optional<Pipeline::Held> taken_over(const Pipeline& pipeline) {
  constexpr Duration kInNoTime = std::chrono::minutes(1);
  if (pipeline.correction_interval() < kInNoTime) {
    return std::nullopt;
  }
  return Pipeline::Held{pipeline.gyros(), pipeline.errors()};
}

/// With the parameters in use at the end of the pass; `taken`: those that the last correction took over.
OpenLoopForecast forecast_of(const CalibrationOptions& options, const Pipeline& pipeline,
                             const std::optional<Pipeline::Held>& taken, const AttitudeHistory& attitude) {
  const BodyMotion motion(attitude.t, attitude.q_in_c);
  const AttitudeRule rule = attitude_rule_of(options.estimator);
  if (options.corrections.take_parameters) {
    return taken ? forecast(taken->errors, taken->gyros, motion, rule, options.need)
                 : forecast(pipeline.errors(), pipeline.gyros(), motion, rule, options.need);
  }
  // The next correction knows the attitude as well as the last one did.
  Eigen::Vector3d sigma_rad = attitude.sigma_rad.front();
  for (std::size_t i = 1; i < attitude.size(); ++i) {
    sigma_rad = attitude.age_s[i] < attitude.age_s[i - 1] ? attitude.sigma_rad[i] : sigma_rad;
  }
  const Pipeline::Held held =
      pipeline.held_at(Rot<In, C>::assume(attitude.q_in_c.back()), Eigen::Matrix3d(sigma_rad.cwiseAbs2().asDiagonal()));
  return forecast(held.errors, held.gyros, motion, rule, options.need);
}

/// How far the parameters that were held are off those that the filter has found, where that is worst.
void put_misfit_into(NavigationRun& run, const Pipeline& pipeline) {
  constexpr double kFalseAlarm = 0.001;  // of all three
  double worst = -1;
  for (const auto& [of, square, freedom] : pipeline.distances_from_prior()) {
    const double limit =
        boost::math::quantile(boost::math::complement(boost::math::chi_squared(freedom), kFalseAlarm / 3));
    if (!(square / limit <= worst)) {
      worst = std::isfinite(square) ? square / limit : std::numeric_limits<double>::infinity();
      run.held_parameters_misfit = square;
      run.misfit_limit = limit;
      run.misfit_of = of;
    }
  }
}

/// What is left to correct of stamps that pass.toml has mended, where the clocks still are as the calibration in use
/// found them. Nothing where it is so old that even a rate known to 0.01 ppm no longer tells the offset.
ClockCorrection clocks_before(const PassSettings& settings) {
  constexpr Duration kHolds = std::chrono::days(30);
  constexpr double kNothing_s = 1e-6;  // no attitude shows it
  if (!settings.prior || !settings.prior->clocks) {
    return {};
  }
  const Duration since = settings.epoch - settings.prior->epoch;
  if (std::chrono::abs(since) > kHolds) {
    return {};
  }
  ClockCorrection left = *settings.prior->clocks;
  left.offset_s += left.rate_s_s * to_seconds(since) - settings.star_tracker_clock_offset_s;
  left.rate_s_s -= settings.star_tracker_clock_rate_s_s;
  for (std::size_t k = 0; k < std::min(settings.gyros.size(), std::size_t{kMaxGyros}); ++k) {
    double& late_s = left.late_s[static_cast<int>(k)];
    late_s -= settings.gyros[k].latency_s;
    late_s = std::abs(late_s) < kNothing_s ? 0 : late_s;
  }
  left.offset_s = std::abs(left.offset_s) < kNothing_s ? 0 : left.offset_s;
  left.rate_s_s = std::abs(left.rate_s_s) * to_seconds(settings.duration) < kNothing_s ? 0 : left.rate_s_s;
  return left;
}

/// What an estimator on board left out of the field that the pass showed, or of that of the earlier calibration;
/// nothing where another model was asked for.
std::optional<LeftOut> left_out_by(const PassSettings& settings, const CalibrationOptions& asked,
                                   const Decision& decision) {
  if (decision.left_out || decision.options.estimator != Estimator::kInvariant || !settings.prior) {
    return decision.left_out;
  }
  const std::optional<OnBoardDrift>& on_board = settings.prior->on_board_drift;
  if (asked.drift_model && !(on_board && on_board->drift_model == *asked.drift_model)) {
    return std::nullopt;
  }
  LeftOut left_out(*settings.prior, *decision.options.drift_model);
  return left_out.nothing() ? std::nullopt : std::optional(std::move(left_out));
}

/// By the latest readings; where they are not those of a pair, without which the momenta stay where they were, at the
/// last fix that was used.
Rot<In, C> attitude_at_the_end(const Pipeline& pipeline, const CalibrationRun& run) {
  if (const std::optional<AttitudeSolution> attitude = pipeline.navigation_attitude()) {
    return attitude->C_in_c;
  }
  return run.attitude.size() > 0 ? Rot<In, C>::assume(run.attitude.q_in_c.back()) : Rot<In, C>();
}

/// `pass`: with its stamps corrected; `screened`: by screened_to_decide(), where that was done. Without a verdict.
CalibrationRun calibrate_as_stamped(const Pass& pass, const CalibrationOptions& options, const Progress& progress,
                                    std::optional<Screened> screened = {}) {
  Decision decision = decide(pass, options, progress, std::move(screened));
  const bool by_batch = decision.options.estimator == Estimator::kBatch;
  const PassSettings& settings = decision.settings ? *decision.settings : pass.settings;
  CalibrationOptions flown = by_batch ? options_of_on_board_run(settings, decision) : decision.options;
  flown.direction_random_walk_rad_sqrt_s =
      std::hypot(flown.direction_random_walk_rad_sqrt_s, decision.left_out_walk_rad_sqrt_s);
  const bool is_flown = decision.run && decision.run->is_of(settings, flown);
  OnBoardRun on_board =
      is_flown ? *std::move(decision.run) : OnBoardRun{Pipeline(settings, flown, Pipeline::Steps::kOverSamples), {}};
  decision.run.reset();
  Pipeline& pipeline = on_board.pipeline;
  Recorder& recorder = on_board.recorder;
  const auto fly = [&] {
    ProgressMeter meter(progress, pass.gyro.size());
    if (!is_flown) {
      replay(pass, pipeline, [&](const StepReport& report) {
        recorder.add(report, pipeline);
        meter.step(report);
      });
    } else if (progress) {
      progress(ProgressMeter::kDoing, 1);
    }
    if (!pipeline.started()) {
      throw nothing_used(recorder.run().fixes);
    }
  };
  std::optional<Smoothed> smoothed;
  if (by_batch) {
    side_by_side(fly, [&] { smoothed.emplace(smooth(pass, decision)); });
  } else {
    fly();
  }
  std::vector<FixRecord> contradicted;
  if (!by_batch) {
    contradicted = fly_without_contradicted(pass, settings, flown, decision, on_board);
  }
  CalibrationRun run = std::move(recorder).take();
  put_into(run.fixes, std::move(contradicted));
  run.options = decision.options;
  run.evidence = decision.evidence;
  run.orbital_error_over_drift = decision.orbital_error_over_drift;
  run.moved_by_orbital_drift_rad = decision.moved_by_orbital_drift_rad;
  run.orbital_error_over_field = decision.orbital_error_over_field;
  run.field_or_error = decision.field_or_error;
  run.against_field = decision.against_field;
  run.changes = decision.changes;
  run.known_before = known_before(settings, decision.options, decision.field);
  const Statistics recorded = run.calibration.statistics;
  run.calibration = pipeline.calibration();
  run.errors = pipeline.errors();
  run.calibration.statistics = recorded;
  run.calibration.start_up = pass.settings.start_up;
  run.calibration.drift_field = decision.levels;
  if (smoothed) {
    run.drift_models = std::move(smoothed->drift_models);
    std::move(smoothed->refinement).put_into(run);
    if (decision.options.drift_field) {
      const LeftOut left_out(run.calibration, drift_on_board(mean_squares_of(run.calibration)).drift_model);
      run.calibration.on_board_drift = {left_out.kept_model(),
                                        left_out_walk_rad_sqrt_s(left_out, run.calibration, decision.screened->pass)};
    }
    if (decision.options.drift_field && !decision.field) {  // the spectrum is that of the earlier calibration
      run.calibration.drift_field = pass.settings.prior->drift_field;
    }
  }
  for (const FixRecord& fix : run.fixes) {
    ++run.fix_counts[fix.status];
  }
  add_statistics(run.fixes, run.calibration.statistics);
  put_changes_into_errors(run);
  run.calibration.forecast = forecast_of(run, pass.gyro.t.back());
  if (const std::optional<LeftOut> left_out = left_out_by(pass.settings, options, decision)) {
    run.calibration.on_board_drift = {left_out->kept_model(), decision.left_out_walk_rad_sqrt_s};
    if (run.calibration.noise) {  // what the pass needs: what stands for the members left out is beside it
      run.calibration.noise->direction_random_walk_rad_sqrt_s = decision.options.direction_random_walk_rad_sqrt_s;
    }
    run.calibration = left_out->completed(std::move(run.calibration), attitude_at_the_end(pipeline, run));
    run.parameters = left_out->completed(run.parameters);
    run.known_before = pass.settings.prior ? left_out->completed(std::move(run.known_before), {})
                                           : left_out->completed_prior(std::move(run.known_before));
    if (pass.settings.prior) {
      run.calibration.drift_field = pass.settings.prior->drift_field;
    }
  }
  run.calibration.amplitude_covariance = amplitude_covariance(run);
  return run;
}

/// A pass without the fixes beside outages of the star tracker, where these are off.
struct WithoutErrorsBesideOutages {
  Pass pass;
  ErrorsBesideOutages errors;
};
std::optional<WithoutErrorsBesideOutages> without_errors_beside_outages(const Pass& pass, CalibrationOptions options,
                                                                        const Progress& progress) {
  const std::optional<Pass> rest = without_fixes_beside_outages(pass);
  if (!rest) {
    return std::nullopt;
  }
  begin_stage(progress, "looks at the fixes beside outages of the star tracker");
  options.estimator = Estimator::kBatch;
  options.definitive_attitude = true;
  std::optional<ErrorsBesideOutages> errors;
  try {
    errors = errors_beside_outages(pass, calibrate_as_stamped(*rest, options, {}));
  } catch (const SetupError&) {  // the batch refuses passes that the filter takes
    return std::nullopt;
  }
  if (!errors) {
    return std::nullopt;
  }
  Pass used = without_fixes_beside_outages(pass, {.before = errors->before, .after = !errors->before}).value();
  errors->fixes = std::ssize(pass.star_tracker.t) - std::ssize(used.star_tracker.t);
  return WithoutErrorsBesideOutages{std::move(used), *errors};
}

/// What a pass says without the earlier calibration that it was given as prior; nothing where that is not to be
/// trusted.
std::optional<Calibration> by_pass_alone(Pass pass, const CalibrationOptions& options, const Progress& progress) {
  begin_stage(progress, "calibrates without the prior, to compare");
  pass.settings.prior.reset();
  try {
    CalibrationRun run = calibrate_as_stamped(pass, options, {});
    run.calibration.determined = determined(run);
    return judge(pass, run).trustworthy ? std::optional(std::move(run.calibration)) : std::nullopt;
  } catch (const SetupError&) {
    return std::nullopt;
  }
}

/// The pass screened before it is known whether it needs a correction: nothing where that turns out, or where decide()
/// is to say what is wrong.
std::optional<Screened> screened_ahead(const Pass& as_given, const CalibrationOptions& options,
                                       const StopRequest& stop_screening) {
  const StopScope scope(&stop_screening);
  try {
    return screened_to_decide(as_given, options);
  } catch (const Stopped&) {
    return std::nullopt;
  } catch (const SetupError&) {
    return std::nullopt;
  }
}

}  // namespace

CalibrationRun calibrate(const Pass& pass, const CalibrationOptions& options, const Progress& progress) {
  return calibrate_after(pass, options, progress, std::nullopt);
}

CalibrationRun calibrate_after(const Pass& as_given, const CalibrationOptions& options, const Progress& progress,
                               std::optional<Calibration> known_before) {
  begin_stage(progress, "looks at the clocks");
  StopRequest stop_screening(StopScope::current());
  std::optional<CorrectedPass> corrected;
  std::optional<Screened> screened;  // of the pass as it was given
  side_by_side(
      [&] {
        try {
          corrected.emplace(as_given, options, stop_screening);
        } catch (...) {
          stop_screening.make();
          throw;
        }
      },
      [&] { screened = screened_ahead(as_given, options, stop_screening); });
  check_stop();
  if (&corrected->pass() != &as_given) {
    screened.reset();
  }
  const CalibrationOptions& asked = corrected->options();
  std::optional<WithoutErrorsBesideOutages> without_errors;
  // Of correlated fixes too few of those that stay are beside outages.
  if (looks_for_noise(options) && !corrected->has_correlated_fixes()) {
    without_errors = without_errors_beside_outages(corrected->pass(), asked, progress);
  }
  if (without_errors) {
    screened.reset();
  }
  const Pass& pass = without_errors ? without_errors->pass : corrected->pass();
  CalibrationRun run = calibrate_as_stamped(pass, asked, progress, std::move(screened));
  if (pass.settings.prior && !known_before) {
    run.by_pass_alone = by_pass_alone(pass, asked, progress);
  }
  if (without_errors) {
    run.beside_outages = without_errors->errors;
  }
  corrected->put_into(run);
  if (known_before) {
    run.known_before = *std::move(known_before);
  }
  run.calibration.determined = determined(run);
  // What changes is judged by the sigmas that are claimed without it.
  run.calibration.verdict = judge(pass, run);
  run.covariance_of_constants = run.calibration.covariance;
  put_changes_into_covariance(run);
  return run;
}

NavigationRun navigate(const Pass& pass, const CalibrationOptions& options, const Progress& progress) {
  const ClockCorrection correction = clocks_before(pass.settings);
  std::optional<Pass> corrected;
  if (correction.of_star_tracker() || correction.of_gyros()) {
    corrected = pass;
    correct(*corrected, correction);
  }
  const Pass& in_time = corrected ? *corrected : pass;
  const std::optional<ReadoutNoise> noise = options.find_noise ? other_readout_noise(in_time) : std::nullopt;
  const std::optional<Pass> with_noise = noise ? std::optional(with(*noise, in_time)) : std::nullopt;
  const Pass& as_stamped = with_noise ? *with_noise : in_time;
  std::vector<CorrelatedFixes> correlated;
  if (options.find_noise) {
    correlated = correlated_fixes(as_stamped);
  }
  const std::optional<Pass> independent = without(correlated, as_stamped);
  const Pass& stamped = independent ? *independent : as_stamped;
  Pipeline pipeline(stamped.settings, settled_for_flight(stamped.settings, options));
  NavigationRecorder recorder;
  ProgressMeter meter(progress, stamped.gyro.size());
  std::optional<Pipeline::Held> taken;
  replay(stamped, pipeline, [&](const StepReport& report) {
    recorder.add(report, pipeline);
    if (report.corrected && options.corrections.take_parameters) {
      taken = taken_over(pipeline);
    }
    meter.step(report);
  });
  NavigationRun run = std::move(recorder).take();
  if (run.attitude.t.empty()) {
    throw nothing_used(run.fixes);
  }
  add_statistics(run.fixes, run.statistics);
  if (!options.corrections.take_parameters) {
    put_misfit_into(run, pipeline);
  }
  run.gyros = pipeline.layout().gyros;
  run.has_clock_state = pipeline.layout().further.clock_offset;
  if (has_pair_at_end(run.gyro_events, run.gyros, stamped.gyro.t.back())) {
    run.forecast = forecast_of(options, pipeline, taken, run.attitude);
  }
  run.clock_correction = correction;
  run.readout_noise = noise;
  if (options.find_noise) {  // they stay: what follows them is not known yet where an attitude is given
    if (const std::optional<WrongReadings> wrong = wrong_for_a_moment(in_time)) {
      run.bursts = wrong->bursts;
    }
  }
  run.correlated_fixes = std::move(correlated);
  run.clocks = clocks_of(as_stamped);
  if (const std::optional<RegularStamps> regular = regular_stamps(pass)) {
    run.gyro_stamps_off_s = regular->scatter_s;
  }
  run.verdict = judge_navigation(stamped, run);
  return run;
}

}  // namespace trihedron::ground
