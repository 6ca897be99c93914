#include "trihedron/campaign/perform.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "trihedron/campaign/sampling.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/ground/calibrate/calibrate.hpp"
#include "trihedron/ground/judge/verdict.hpp"
#include "trihedron/ground/model/reason_of_failure.hpp"
#include "trihedron/ground/model/setup_error.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/lanes/filter_flight.hpp"

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

void put_into(std::vector<std::string>& names, const Verdict& verdict) {
  for (const Finding& finding : verdict.findings) {
    names.emplace_back(name_of(finding.code));
  }
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
  put_into(record.findings, calibration.verdict);
  measure_parameters(flight, plan, record);
  measure_fixes(flight.run, record);
  measure_attitude(flight.evaluation, record);
  measure_open_loops(flight.evaluation, record);
  record[RunQuantity::kDriftSettled] = {seconds(flight.evaluation.drift_settled)};
  record[RunQuantity::kAlignmentSettled] = {seconds(flight.evaluation.alignment_settled)};
  return record;
}

namespace {

/// Of its fixes, the first among them. Those at which the filter began anew or widened its sigmas count as rejected.
Statistics statistics_of(const lanes::FilterResult& result) {
  Statistics statistics;
  statistics.fixes = static_cast<long>(1 + result.fixes_judged);
  statistics.fixes_used = static_cast<long>(1 + result.fixes_used);
  statistics.fixes_rejected_as_outliers = static_cast<long>(result.fixes_judged - result.fixes_used);
  statistics.reopened = static_cast<long>(result.reopened);
  return statistics;
}

/// What fly_filters() makes of a flight, of the gyros of the plan: a run may have more or fewer.
RunRecord record_of(const lanes::FilterResult& result, const CampaignPlan& plan) {
  const std::size_t gyros = std::min(plan.gyros, static_cast<std::size_t>(result.error.size()) / kCampaignParameters);
  const auto size = static_cast<Eigen::Index>(gyros * kCampaignParameters);
  const Eigen::VectorXd error = result.error.head(size);
  const Eigen::MatrixXd covariance = result.covariance.topLeftCorner(size, size);
  RunRecord record;
  const Verdict verdict = ground::judge_use_of_fixes(statistics_of(result));
  const bool is_trustworthy = verdict.trustworthy && result.reopened == 0;
  record.outcome = is_trustworthy ? RunOutcome::kTrustworthy : RunOutcome::kDoNotUse;
  put_into(record.findings, verdict);
  record.drift_model = name_of(result.drift_model);
  for (const RunQuantityRow& row : kRunQuantityRows) {
    if (plan.has(row.quantity)) {
      record[row.quantity].assign(size_of(row.shape, plan.gyros), kNone);
    }
  }
  for (Eigen::Index i = 0; i < size; ++i) {
    const std::size_t gyro = static_cast<std::size_t>(i) / kCampaignParameters;
    const std::size_t its = static_cast<std::size_t>(i) % kCampaignParameters;
    const bool of_alignment = its >= kCampaignCoefficients;
    const std::size_t place =
        of_alignment ? 3 * gyro + its - kCampaignCoefficients : kCampaignCoefficients * gyro + its;
    record[of_alignment ? RunQuantity::kAlignmentError : RunQuantity::kDriftError][place] = error(i);
    record[of_alignment ? RunQuantity::kAlignmentSigma : RunQuantity::kDriftSigma][place] = std::sqrt(covariance(i, i));
    for (Eigen::Index j = 0; plan.keeps_covariance && j < size; ++j) {
      const std::size_t row = static_cast<std::size_t>(i) * plan.gyros * kCampaignParameters;
      record[RunQuantity::kCovariance][row + static_cast<std::size_t>(j)] = covariance(i, j);
    }
  }
  const auto mean = [](double sum, std::size_t count) { return count > 0 ? sum / static_cast<double>(count) : kNone; };
  record[RunQuantity::kNees] = {ground::normalised_square(error, covariance)};
  record[RunQuantity::kNeesFreedom] = {static_cast<double>(size)};
  record[RunQuantity::kNisMean] = {mean(result.nis_sum, result.fixes_used)};
  record[RunQuantity::kNisFreedom] = {2.0 * static_cast<double>(result.error.size()) / kCampaignParameters};
  record[RunQuantity::kNisFixes] = {static_cast<double>(result.fixes_used)};
  record[RunQuantity::kNisMeanOfAll] = {mean(result.nis_sum_of_judged, result.fixes_judged)};
  record[RunQuantity::kNisFixesOfAll] = {static_cast<double>(result.fixes_judged)};
  record[RunQuantity::kAttitudeRms] = {result.attitude_rms_rad.x(), result.attitude_rms_rad.y(),
                                       result.attitude_rms_rad.z()};
  record[RunQuantity::kAttitudeNormalisedSquare] = {result.attitude_normalised_square};
  return record;
}

}  // namespace

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

namespace {

/// When runs were begun, by the clock and of the processor of this thread.
class Begun {
 public:
  /// Puts what has passed since into records, each an equal part of it.
  void tell(std::span<RunRecord> records) const {
    const auto count = static_cast<double>(records.size());
    for (RunRecord& record : records) {
      record.cpu_s = (thread_cpu_s() - cpu_s_) / count;
      record.elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - at_).count() / count;
    }
  }

 private:
  std::chrono::steady_clock::time_point at_ = std::chrono::steady_clock::now();
  double cpu_s_ = thread_cpu_s();
};

/// That of a run, or the record of one whose draws make none.
std::variant<RunSetup, RunRecord> setup_or_failure(const CampaignPlan& plan, std::uint64_t run,
                                                   const SetupOf& setup_of) {
  try {
    return setup_of(seed_of_run(plan, run), draws_of_run(plan, run));
  } catch (const std::invalid_argument& error) {
    return failed(plan, run, error.what());
  }
}

void identify(const CampaignPlan& plan, std::uint64_t run, RunRecord& record) {
  record.run = run;
  record.seed = seed_of_run(plan, run);
  record.draws = draws_of_run(plan, run);
}

/// What `calibrate` makes of the flight of a filter, where it makes anything of it.
void fly_beside(const RunSetup& setup, double limit_rad, const std::function<void(Flight&&)>& flown) {
  std::optional<Flight> flight;
  try {
    flight = fly(setup, limit_rad, ground::OpenLoopScope::kAll);
  } catch (const std::invalid_argument&) {
    return;
  } catch (const ground::SetupError&) {
    return;
  }
  flown(std::move(*flight));
}

std::vector<RunRecord> fly_filters(const CampaignPlan& plan, std::span<const std::uint64_t> runs,
                                   const SetupOf& setup_of) {
  std::vector<std::optional<RunRecord>> records(runs.size());
  std::vector<lanes::FilterFlight> flights;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::variant<RunSetup, RunRecord> setup = setup_or_failure(plan, runs[i], setup_of);
    if (auto* const failure = std::get_if<RunRecord>(&setup)) {
      records[i] = std::move(*failure);
    } else {
      RunSetup& its = std::get<RunSetup>(setup);
      flights.push_back({std::move(its.scenario), std::move(its.options)});
      places.push_back(i);
    }
  }
  const std::vector<lanes::FilterOutcome> outcomes = lanes::fly(flights);
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    const auto* const failure = std::get_if<lanes::FilterFailure>(&outcomes[i]);
    records[places[i]] = failure != nullptr ? failed(plan, runs[places[i]], failure->reason)
                                            : record_of(std::get<lanes::FilterResult>(outcomes[i]), plan);
  }
  std::vector<RunRecord> all;
  for (std::optional<RunRecord>& record : records) {
    all.push_back(std::move(record).value());
  }
  return all;
}

}  // namespace

RunRecord perform(const CampaignPlan& plan, std::uint64_t run, const SetupOf& setup_of,
                  const std::function<void(Flight&&)>& flown) {
  if (plan.work == CampaignWork::kFilter) {
    RunRecord record = perform_together(plan, {&run, 1}, setup_of).front();
    if (flown && record.outcome != RunOutcome::kFailed) {
      fly_beside(setup_of(record.seed, record.draws), plan.limit_rad, flown);
    }
    return record;
  }
  const Begun begun;
  RunRecord record;
  std::variant<RunSetup, RunRecord> setup = setup_or_failure(plan, run, setup_of);
  if (auto* const failure = std::get_if<RunRecord>(&setup)) {
    record = std::move(*failure);
  } else {
    const std::optional<std::string> reason = ground::reason_of_failure([&] {
      Flight flight = fly(std::get<RunSetup>(setup), plan.limit_rad,
                          flown ? ground::OpenLoopScope::kAll : ground::OpenLoopScope::kExtension);
      record = record_of(flight, plan);
      if (flown) {
        flown(std::move(flight));
      }
    });
    if (reason) {
      record = failed(plan, run, *reason);
    }
  }
  identify(plan, run, record);
  begun.tell({&record, 1});
  return record;
}

std::size_t runs_together(const CampaignPlan& plan) {
  return plan.work == CampaignWork::kFilter ? lanes::kTogether : 1;
}

std::vector<RunRecord> perform_together(const CampaignPlan& plan, std::span<const std::uint64_t> runs,
                                        const SetupOf& setup_of) {
  std::vector<RunRecord> records;
  if (plan.work == CampaignWork::kFilter) {
    const Begun begun;
    records = fly_filters(plan, runs, setup_of);
    for (std::size_t i = 0; i < runs.size(); ++i) {
      identify(plan, runs[i], records[i]);
    }
    begun.tell(records);
  } else {
    for (const std::uint64_t run : runs) {
      records.push_back(perform(plan, run, setup_of));
    }
  }
  return records;
}

void perform_all(const CampaignPlan& plan, std::span<const std::uint64_t> runs, const SetupOf& setup_of, unsigned jobs,
                 const Collect& collect) {
  std::mutex one_at_a_time;
  const std::size_t for_each_job = (runs.size() + jobs - 1) / jobs;
  const std::size_t together = std::clamp<std::size_t>(for_each_job, 1, runs_together(plan));
  ground::with_cores(jobs, [&] {
    ground::for_each_on_all_cores((runs.size() + together - 1) / together, [&](std::size_t i) {
      const std::span<const std::uint64_t> some =
          runs.subspan(i * together, std::min(together, runs.size() - i * together));
      std::vector<RunRecord> records;
      // Many runs keep all cores busy; within a run nothing is gained by more than one, and its CPU time is its own.
      ground::with_cores(1, [&] { records = perform_together(plan, some, setup_of); });
      const std::scoped_lock lock(one_at_a_time);
      collect(std::move(records));
    });
  });
}

}  // namespace trihedron::campaign
