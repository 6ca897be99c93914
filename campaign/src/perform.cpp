#include "trihedron/campaign/perform.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

#include "trihedron/campaign/sampling.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::campaign {
namespace {

/// Where there is no number. std::fmax(), by which the largest of several is found, leaves it out.
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Corrections that count: at the first nothing is calibrated yet.
constexpr std::size_t kFirstCounted = 1;

double seconds(const std::optional<Duration>& duration) { return duration ? to_seconds(*duration) : kNone; }

double thread_cpu_s() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  if (values.empty()) {
    return kNone;
  }
  std::ranges::sort(values);
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

/// Smallest value that at least `p` of the sorted ones do not exceed.
double quantile(const std::vector<double>& sorted, double p) {
  if (sorted.empty()) {
    return kNone;
  }
  const auto rank = static_cast<std::size_t>(std::ceil(p * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(rank, 1, sorted.size()) - 1];
}

/// Which of its gyro's parameters a state is, coefficients before alignment; nothing for any other state.
std::optional<std::size_t> parameter_of(const ParameterId& state) {
  if (state.is_alignment()) {
    return kCampaignCoefficients + state.component;
  }
  for (std::size_t k = 0; k < kCampaignCoefficients; ++k) {
    if (state == ParameterId::drift(state.gyro(), coefficients_of(kEsg7)[k])) {
      return k;
    }
  }
  return std::nullopt;
}

/// Parameters of eq. (1) and alignments, with their errors.
void measure_parameters(const Flight& flight, const CampaignPlan& plan, RunRecord& record) {
  const Calibration& calibration = flight.run.calibration;
  record[RunQuantity::kDriftError].assign(plan.gyros * kCampaignCoefficients, kNone);
  record[RunQuantity::kDriftSigma].assign(plan.gyros * kCampaignCoefficients, kNone);
  record[RunQuantity::kAlignmentError].assign(3 * plan.gyros, kNone);
  record[RunQuantity::kAlignmentSigma].assign(3 * plan.gyros, kNone);
  std::vector<Eigen::Index> rows;
  std::vector<std::pair<std::size_t, Eigen::Index>> parameters;  // their numbers and rows
  for (std::size_t i = 0; i < calibration.states.size(); ++i) {
    const ParameterId& state = calibration.states[i];
    const auto row = static_cast<Eigen::Index>(i);
    const std::optional<std::size_t> parameter = parameter_of(state);
    if (!parameter || state.gyro() >= plan.gyros) {
      continue;
    }
    parameters.emplace_back(state.gyro() * kCampaignParameters + *parameter, row);
    const double error = flight.evaluation.estimate_minus_truth(row);
    const bool of_alignment = state.is_alignment();
    const std::size_t place =
        of_alignment ? 3 * state.gyro() + state.component : kCampaignCoefficients * state.gyro() + *parameter;
    record[of_alignment ? RunQuantity::kAlignmentError : RunQuantity::kDriftError][place] = error;
    record[of_alignment ? RunQuantity::kAlignmentSigma : RunQuantity::kDriftSigma][place] =
        std::sqrt(calibration.covariance(row, row));
    if (std::isfinite(error)) {
      rows.push_back(row);
    }
  }
  if (plan.keeps_covariance) {
    const std::size_t size = plan.gyros * kCampaignParameters;
    std::vector<double>& kept = record[RunQuantity::kCovariance];
    kept.assign(size * size, kNone);
    for (const auto& [a, row] : parameters) {
      for (const auto& [b, column] : parameters) {
        kept[a * size + b] = calibration.covariance(row, column);
      }
    }
  }
  record[RunQuantity::kNees] = {
      ground::normalised_square(flight.evaluation.estimate_minus_truth(rows), calibration.covariance(rows, rows))};
  record[RunQuantity::kNeesFreedom] = {static_cast<double>(rows.size())};
}

void measure_fixes(const CalibrationRun& run, RunRecord& record) {
  const Statistics& statistics = run.calibration.statistics;
  record[RunQuantity::kNisMean] = {statistics.nis_mean.value_or(kNone)};
  record[RunQuantity::kNisFreedom] = {statistics.nis_degrees_of_freedom};
  record[RunQuantity::kNisFixes] = {static_cast<double>(statistics.nis_count)};
  double sum = 0;
  double count = 0;
  for (const FixRecord& fix : run.fixes) {
    if (fix.status == FixStatus::kRejectedByGate || (fix.used() && fix.status != FixStatus::kStarted)) {
      sum += fix.nis;
      count += 1;
    }
  }
  record[RunQuantity::kNisMeanOfAll] = {count > 0 ? sum / count : kNone};
  record[RunQuantity::kNisFixesOfAll] = {count};
}

void measure_attitude(const ground::CalibrationEvaluation& evaluation, RunRecord& record) {
  const ground::ErrorStatistics& whole = evaluation.attitude.whole;
  record[RunQuantity::kAttitudeRms] = {whole.rms_rad.x(), whole.rms_rad.y(), whole.rms_rad.z()};
  record[RunQuantity::kAttitudeNormalisedSquare] = {whole.normalised_square.value_or(kNone)};

  const ground::AttitudeErrors& navigation = evaluation.navigation.errors;
  std::vector<double> errors;
  double corrected = kNone;
  std::size_t corrections = 0;
  for (std::size_t i = 0; i < navigation.age_s.size(); ++i) {
    const bool is_first_after = i == 0 || navigation.age_s[i] < navigation.age_s[i - 1];
    corrections += is_first_after ? 1 : 0;
    if (corrections <= kFirstCounted) {
      continue;
    }
    const double error = navigation.error_rad[i].norm();
    if (!std::isnan(error)) {
      errors.push_back(error);
    }
    if (is_first_after) {
      corrected = std::fmax(corrected, error);
    }
  }
  std::ranges::sort(errors);
  for (const double p : kErrorQuantiles) {
    record[RunQuantity::kNavigationError].push_back(quantile(errors, p));
  }
  record[RunQuantity::kCorrectedError] = {corrected};
}

/// Largest error until `length` after the first epoch, if any.
double largest(const ground::AttitudeErrors& errors, Duration length) {
  double greatest = kNone;
  for (std::size_t i = 0; i < errors.t.size() && errors.t[i] - errors.t.front() <= length; ++i) {
    greatest = std::fmax(greatest, errors.error_rad[i].norm());
  }
  return greatest;
}

void measure_open_loops(const ground::CalibrationEvaluation& evaluation, RunRecord& record) {
  double within = kNone;
  double before = kNone;
  double to_end = kNone;
  std::vector<double> interval_before;
  std::vector<double> interval_after;
  bool is_lower_bound = false;
  for (std::size_t i = kFirstCounted; i < evaluation.open_loops.size(); ++i) {
    const ground::OpenLoops& loops = evaluation.open_loops[i];
    const ground::IntervalPair& pair = loops.intervals;
    if (loops.calibrated.t.empty() || pair.calibrated.observed <= Duration::zero()) {
      continue;
    }
    within = std::fmax(within, largest(loops.calibrated, ground::kEvaluatedStretch));
    before = std::fmax(before, largest(loops.known_before, ground::kEvaluatedStretch));
    to_end = std::fmax(to_end, largest(loops.calibrated, Duration::max()));
    interval_before.push_back(to_seconds(pair.known_before.passed.value_or(pair.known_before.observed)));
    interval_after.push_back(to_seconds(pair.calibrated.passed.value_or(pair.calibrated.observed)));
    is_lower_bound = is_lower_bound || !pair.calibrated.passed;
  }
  record[RunQuantity::kOpenLoopError] = {within};
  record[RunQuantity::kOpenLoopErrorBefore] = {before};
  record[RunQuantity::kOpenLoopErrorToEnd] = {to_end};
  record[RunQuantity::kIntervalBefore] = {median(interval_before)};
  record[RunQuantity::kIntervalAfter] = {median(interval_after)};
  record[RunQuantity::kIntervalAfterIsLowerBound] = {interval_after.empty() ? kNone : is_lower_bound ? 1.0 : 0.0};
  const std::optional<ground::Extension>& extension = evaluation.extension.median;
  record[RunQuantity::kExtension] = {extension ? extension->factor : kNone};
  record[RunQuantity::kExtensionIsLowerBound] = {!extension ? kNone : extension->is_lower_bound ? 1.0 : 0.0};
}

}  // namespace

Flight fly(const RunSetup& setup, double limit_rad, ground::OpenLoopScope scope) {
  Flight flight{sim::simulate(setup.scenario), {}, {}};
  flight.run = ground::calibrate(flight.simulated.pass, setup.options);
  flight.evaluation =
      ground::evaluate_calibration(flight.simulated.pass, flight.run, &flight.simulated.truth, limit_rad, scope);
  return flight;
}

RunRecord record_of(const Flight& flight, const CampaignPlan& plan) {
  RunRecord record;
  const Calibration& calibration = flight.run.calibration;
  record.outcome = calibration.verdict.trustworthy ? RunOutcome::kTrustworthy : RunOutcome::kDoNotUse;
  record.drift_model = flight.run.options.drift_field ? "field" : name_of(calibration.gyros.front().drift_model);
  for (const Finding& finding : calibration.verdict.findings) {
    record.findings.emplace_back(name_of(finding.code));
  }
  measure_parameters(flight, plan, record);
  measure_fixes(flight.run, record);
  measure_attitude(flight.evaluation, record);
  measure_open_loops(flight.evaluation, record);
  record[RunQuantity::kDriftSettled] = {seconds(flight.evaluation.drift_settled)};
  record[RunQuantity::kAlignmentSettled] = {seconds(flight.evaluation.alignment_settled)};
  return record;
}

RunRecord failed(const CampaignPlan& plan, std::uint64_t run, std::string reason) {
  RunRecord record;
  record.run = run;
  record.seed = seed_of_run(plan, run);
  record.draws = draws_of_run(plan, run);
  record.reason = std::move(reason);
  for (const RunQuantityRow& row : kRunQuantityRows) {
    if (plan.has(row.quantity)) {
      record[row.quantity].assign(size_of(row.shape, plan.gyros), kNone);
    }
  }
  return record;
}

RunRecord perform(const CampaignPlan& plan, std::uint64_t run, const SetupOf& setup_of,
                  const std::function<void(Flight&&)>& flown) {
  const auto begun = std::chrono::steady_clock::now();
  const double cpu_before_s = thread_cpu_s();
  const std::uint64_t seed = seed_of_run(plan, run);
  const std::vector<double> draws = draws_of_run(plan, run);
  RunRecord record;
  std::optional<RunSetup> setup;
  try {
    setup = setup_of(seed, draws);
  } catch (const std::invalid_argument& error) {
    record = failed(plan, run, error.what());
  }
  if (setup) {
    try {
      Flight flight =
          fly(*setup, plan.limit_rad, flown ? ground::OpenLoopScope::kAll : ground::OpenLoopScope::kExtension);
      record = record_of(flight, plan);
      if (flown) {
        flown(std::move(flight));
      }
    } catch (const Stopped&) {
      throw;
    } catch (const std::bad_alloc&) {
      throw;  // it says nothing of the run
    } catch (const ground::SetupError& error) {
      record = failed(plan, run, std::string(error.what()) + "; " + error.cure());
    } catch (const std::exception& error) {
      record = failed(plan, run, error.what());
    }
  }
  record.run = run;
  record.seed = seed;
  record.draws = draws;
  record.cpu_s = thread_cpu_s() - cpu_before_s;
  record.elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return record;
}

void perform_all(const CampaignPlan& plan, std::span<const std::uint64_t> runs, const SetupOf& setup_of, unsigned jobs,
                 const Collect& collect) {
  std::mutex one_at_a_time;
  ground::with_cores(jobs, [&] {
    ground::for_each_on_all_cores(runs.size(), [&](std::size_t i) {
      std::vector<RunRecord> records;
      // Many runs keep all cores busy; within a run nothing is gained by more than one, and its CPU time is its own.
      ground::with_cores(1, [&] { records.push_back(perform(plan, runs[i], setup_of)); });
      const std::scoped_lock lock(one_at_a_time);
      collect(std::move(records));
    });
  });
}

}  // namespace trihedron::campaign
