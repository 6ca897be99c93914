#include "trihedron/campaign/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <regex>
#include <set>
#include <utility>

#include "trihedron/campaign/sampling.hpp"
#include "trihedron/records/parameter_id.hpp"

namespace trihedron::campaign {
namespace {

constexpr double kUsual = 0.95;
constexpr double kLimit = 0.999;
/// Sigmas too small by more than this are not to be used: an error budget of 3 sigma then is one of 2.5, exceeded five
/// times as often.
constexpr double kMostSigmaFactor = 1.2;
/// Below this the innovations of a few hundred runs differ from χ² by things that nobody would act on.
constexpr double kNisMatters = 0.02;
/// A NEES that a consistent run passes once in a million times is taken for an error of its sigmas.
constexpr double kCertainlyWrong = 1e-6;
/// Share of such runs among those called trustworthy that is too large, where it is exceeded for certain.
constexpr double kMostWrong = 0.01;
constexpr std::size_t kWorstOfEach = 3;

double or_infinite(const RunRecord& record, RunQuantity quantity) {
  const bool is_measured = record.outcome != RunOutcome::kFailed && !record[quantity].empty();
  const double value = record.at(quantity);
  return is_measured && std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
}

double norm_of(const RunRecord& record, RunQuantity quantity, std::size_t from) {
  return std::hypot(record.at(quantity, from), record.at(quantity, from + 1), record.at(quantity, from + 2));
}

double largest_alignment_error(const RunRecord& record) {
  double largest = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i + 2 < record[RunQuantity::kAlignmentError].size(); i += 3) {
    largest = std::fmax(largest, norm_of(record, RunQuantity::kAlignmentError, i));  // leaves out NaN
  }
  return largest;
}

constexpr std::size_t kLargest = kErrorQuantiles.size() - 1;

constexpr std::array<Measure, 11> kMeasures = {{
    {"nees", "NEES of the parameters",
     "squared error of the coefficients of eq. (1) and of the alignments of all gyros, by their covariance",
     Measure::Unit::kNone, true, [](const RunRecord& record) { return record.at(RunQuantity::kNees); }},
    {"alignment_error", "Alignment error, worst gyro",
     "rotation between the estimated and the true alignment, of the gyro of which it is largest",
     Measure::Unit::kRadian, true, largest_alignment_error},
    {"attitude_rms", "Attitude of the calibration, rms",
     "rms error of the attitude that the calibration gives at the fixes, of all three axes together",
     Measure::Unit::kRadian, true,
     [](const RunRecord& record) { return norm_of(record, RunQuantity::kAttitudeRms, 0); }},
    {"navigation_error", "Navigator, corrected every 90 min, largest error",
     "largest error of the navigator from the second correction on", Measure::Unit::kRadian, true,
     [](const RunRecord& record) { return record.at(RunQuantity::kNavigationError, kLargest); }},
    {"corrected_error", "Error right after a correction",
     "largest error of the navigator at the first epoch after a correction, from the second correction on",
     Measure::Unit::kRadian, true, [](const RunRecord& record) { return record.at(RunQuantity::kCorrectedError); }},
    {"open_loop_error", "Open loop of 90 min, largest error",
     "largest error within 90 min after a correction, by the gyros alone with the calibrated parameters",
     Measure::Unit::kRadian, true, [](const RunRecord& record) { return record.at(RunQuantity::kOpenLoopError); }},
    {"open_loop_error_to_end", "Open loop to the end of the pass, largest error",
     "largest error after a correction up to the end of the pass, by the gyros alone with the calibrated parameters",
     Measure::Unit::kRadian, true, [](const RunRecord& record) { return record.at(RunQuantity::kOpenLoopErrorToEnd); }},
    {"drift_settled", "Drift coefficients settled",
     "time since the start after which all coefficients that the pass determines have settled", Measure::Unit::kSecond,
     true, [](const RunRecord& record) { return or_infinite(record, RunQuantity::kDriftSettled); }},
    {"alignment_settled", "Alignments settled",
     "time since the start after which all alignments that the pass determines have settled", Measure::Unit::kSecond,
     true, [](const RunRecord& record) { return or_infinite(record, RunQuantity::kAlignmentSettled); }},
    {"interval_after", "Correction interval",
     "median time by the gyros alone, with the calibrated parameters, until the attitude error passes the limit",
     Measure::Unit::kSecond, false, [](const RunRecord& record) { return record.at(RunQuantity::kIntervalAfter); },
     [](const RunRecord& record) { return record.at(RunQuantity::kIntervalAfterIsLowerBound) == 1; }},
    {"extension", "Extension of the correction interval",
     "correction interval with the calibrated parameters, in multiples of that with the parameters known before",
     Measure::Unit::kRatio, false, [](const RunRecord& record) { return record.at(RunQuantity::kExtension); },
     [](const RunRecord& record) { return record.at(RunQuantity::kExtensionIsLowerBound) == 1; }},
}};

using Records = std::vector<const RunRecord*>;

MeasureStatistics statistics_of(const Measure& measure, const Records& records) {
  MeasureStatistics result{.measure = &measure, .runs = 0, .quantiles = {}};
  std::vector<double> values;
  for (const RunRecord* record : records) {
    const double value = measure.of(*record);
    if (!std::isnan(value)) {
      values.push_back(measure.large_is_bad ? value : -value);
    }
  }
  result.runs = values.size();
  if (values.empty()) {
    return result;
  }
  std::ranges::sort(values);
  for (const double p : kReportedQuantiles) {
    QuantileBounds bounds = quantile_bounds(values, p);
    if (!measure.large_is_bad) {
      const auto negative = [](const std::optional<double>& value) {
        return value ? std::optional(-*value) : std::nullopt;
      };
      bounds = {.p = p, .estimate = -bounds.estimate, .lower = negative(bounds.upper), .upper = negative(bounds.lower)};
    }
    result.quantiles.push_back(bounds);
  }
  return result;
}

/// Squared errors by their covariance, run by run.
class SquaredErrors {
 public:
  /// The sum of a run over so many errors, with its degrees of freedom. Left out where it is no number.
  void add(double sum, double freedom, double count) {
    if (!std::isfinite(sum) || !(freedom > 0)) {
      return;
    }
    ++runs_;
    sum_ += sum;
    freedom_ += freedom;
    count_ += count;
    const double share = chi_square_share(sum, freedom);
    within_ += share >= (1 - kUsual) / 2 && share <= (1 + kUsual) / 2 ? 1U : 0U;
  }
  /// Nothing without a run.
  [[nodiscard]] std::optional<Consistency> consistency() const {
    if (runs_ == 0) {
      return std::nullopt;
    }
    Consistency result = consistency_of(sum_, freedom_, count_);
    result.runs = runs_;
    result.within = static_cast<double>(within_) / static_cast<double>(runs_);
    return result;
  }

 private:
  std::size_t runs_ = 0;
  std::size_t within_ = 0;  ///< the 95 % of their own χ²
  double sum_ = 0;
  double freedom_ = 0;
  double count_ = 0;
};

std::optional<Consistency> nees_of(const Records& records) {
  SquaredErrors errors;
  for (const RunRecord* record : records) {
    errors.add(record->at(RunQuantity::kNees), record->at(RunQuantity::kNeesFreedom), 1);
  }
  return errors.consistency();
}

/// Per fix.
std::optional<Consistency> nis_of(const Records& records) {
  SquaredErrors errors;
  for (const RunRecord* record : records) {
    const double fixes = record->at(RunQuantity::kNisFixes);
    errors.add(record->at(RunQuantity::kNisMean) * fixes, record->at(RunQuantity::kNisFreedom) * fixes, fixes);
  }
  return errors.consistency();
}

ParameterErrors parameter_errors(const ParameterId& parameter, std::size_t place, const Records& records) {
  ParameterErrors result;
  result.name = name_of(parameter);
  result.is_alignment = parameter.is_alignment();
  double normalised = 0;
  for (const RunRecord* record : records) {
    const double error =
        record->at(result.is_alignment ? RunQuantity::kAlignmentError : RunQuantity::kDriftError, place);
    const double sigma =
        record->at(result.is_alignment ? RunQuantity::kAlignmentSigma : RunQuantity::kDriftSigma, place);
    if (std::isfinite(error) && sigma > 0) {
      ++result.runs;
      result.rms += error * error;
      result.sigma += sigma * sigma;
      normalised += (error / sigma) * (error / sigma);
    }
  }
  if (result.runs > 0) {
    const auto n = static_cast<double>(result.runs);
    result.rms = std::sqrt(result.rms / n);
    result.sigma = std::sqrt(result.sigma / n);
    result.normalised = std::sqrt(normalised / n);
    const ChiSquareBounds of_square = chi_square_bounds(n, kUsual);
    result.usual = {std::sqrt(of_square.low), std::sqrt(of_square.high)};
  }
  return result;
}

std::vector<ParameterErrors> errors_of_parameters(std::size_t gyros, const Records& records) {
  std::vector<ParameterErrors> all;
  std::size_t coefficients = 0;
  std::size_t axes = 0;
  for (const ParameterId& parameter : drift_and_alignment(kEsg7, gyros)) {
    all.push_back(parameter_errors(parameter, parameter.is_alignment() ? axes++ : coefficients++, records));
  }
  return all;
}

/// Words have no order; of two words the correlation is that of belonging to the second. What follows another input
/// has its correlations.
bool has_order(const CampaignInput& input) {
  return input.distribution.kind != Distribution::Kind::kFollows &&
         (input.is_number() || input.distribution.options == 2);
}

/// A measure of all runs, in their order.
std::vector<double> scores_of(const Measure& measure, const Records& records) {
  std::vector<double> values;
  std::vector<char> is_lower_bound;
  for (const RunRecord* record : records) {
    values.push_back(measure.of(*record));
    is_lower_bound.push_back(measure.is_lower_bound != nullptr && measure.is_lower_bound(*record) ? 1 : 0);
  }
  return order_scores(values, is_lower_bound);
}

/// The mean of each flight over its runs that have a number; NaN where none has. Records of runs in increasing order.
std::vector<double> means_of_flights(const CampaignPlan& plan, const Records& records,
                                     const std::vector<double>& of_runs) {
  std::map<std::uint64_t, std::pair<double, double>> flights;  // sums and their numbers
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!std::isnan(of_runs[i])) {
      auto& [sum, count] = flights[flight_of_run(plan, records[i]->run)];
      sum += of_runs[i];
      count += 1;
    }
  }
  std::vector<double> means(records.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < records.size(); ++i) {
    // At its first run, so that each flight counts once.
    if (const auto flight = flights.extract(flight_of_run(plan, records[i]->run)); !flight.empty()) {
      means[i] = flight.mapped().first / flight.mapped().second;
    }
  }
  return means;
}

void find_influences(const CampaignPlan& plan, const Records& records, CampaignSummary& summary) {
  std::vector<std::vector<double>> of_runs;
  std::vector<std::vector<double>> of_flights;
  for (const Measure& measure : kMeasures) {
    of_runs.push_back(scores_of(measure, records));
    of_flights.push_back(means_of_flights(plan, records, of_runs.back()));
  }
  for (std::size_t i = 0; i < plan.inputs.size(); ++i) {
    if (!has_order(plan.inputs[i])) {
      continue;
    }
    std::vector<double> drawn;
    for (const RunRecord* record : records) {
      drawn.push_back(plan.inputs[i].shown(record->draws[i]));
    }
    for (std::size_t k = 0; k < kMeasures.size(); ++k) {
      if (const auto correlation = rank_correlation(drawn, plan.inputs[i].is_setting() ? of_runs[k] : of_flights[k])) {
        ++summary.pairs;
        summary.influences.push_back({i, &kMeasures.at(k), *correlation, false});
      }
    }
  }
  for (Influence& influence : summary.influences) {
    // Bonferroni: some are significant by chance where many are looked at.
    influence.is_significant = influence.correlation.p_value < (1 - kUsual) / static_cast<double>(summary.pairs);
  }
  std::ranges::stable_sort(summary.influences, std::ranges::greater{},
                           [](const Influence& influence) { return std::abs(influence.correlation.rho); });
}

GridCell cell_of(std::vector<double> point, std::span<const RunRecord> records, CampaignWork work) {
  GridCell cell;
  cell.point = std::move(point);
  Records trustworthy;
  for (const RunRecord& record : records) {
    ++(record.outcome == RunOutcome::kFailed ? cell.failed : cell.finished);
    if (record.outcome == RunOutcome::kTrustworthy) {
      trustworthy.push_back(&record);
    }
  }
  cell.trustworthy = trustworthy.size();
  cell.nees = nees_of(trustworthy);
  cell.nis = nis_of(trustworthy);
  for (const std::string_view key : cell_measures(work)) {
    cell.measures.push_back(statistics_of(*std::ranges::find(kMeasures, key, &Measure::key), trustworthy));
  }
  return cell;
}

/// A point's runs come one after the other.
void find_cells(const CampaignPlan& plan, std::span<const RunRecord> records, CampaignSummary& summary) {
  for (std::size_t i = 0; i < plan.inputs.size(); ++i) {
    const Distribution& its = plan.inputs[i].distribution;
    if (its.kind == Distribution::Kind::kGrid && its.options > 1) {
      summary.grid.push_back(i);
    }
  }
  if (summary.grid.empty() || plan.repeats < 2) {
    return;
  }
  for (std::size_t begin = 0; begin < records.size();) {
    const std::uint64_t cell = records[begin].run / plan.repeats;
    std::size_t end = begin;
    while (end < records.size() && records[end].run / plan.repeats == cell) {
      ++end;
    }
    std::vector<double> point;
    for (const std::size_t input : summary.grid) {
      point.push_back(records[begin].draws[input]);
    }
    summary.cells.push_back(cell_of(std::move(point), records.subspan(begin, end - begin), plan.work));
    begin = end;
  }
}

void find_worst(std::span<const RunRecord> records, const Records& finished, CampaignSummary& summary) {
  std::size_t failed = 0;
  for (const RunRecord& record : records) {
    if (record.outcome == RunOutcome::kFailed && failed++ < kWorstOfEach) {
      summary.worst.push_back({record.run, "failed: " + record.reason, nullptr, 0});
    }
  }
  for (const std::string_view key : {"nees", "open_loop_error", "alignment_error", "navigation_error"}) {
    const Measure& measure = *std::ranges::find(kMeasures, key, &Measure::key);
    Records sorted;
    std::ranges::copy_if(finished, std::back_inserter(sorted),
                         [&](const RunRecord* record) { return std::isfinite(measure.of(*record)); });
    std::ranges::stable_sort(sorted, std::ranges::greater{},
                             [&](const RunRecord* record) { return measure.of(*record); });
    for (std::size_t i = 0; i < std::min(kWorstOfEach, sorted.size()); ++i) {
      summary.worst.push_back({sorted[i]->run, std::string(measure.label), &measure, measure.of(*sorted[i])});
    }
  }
}

std::string listed(const std::vector<std::uint64_t>& runs) {
  constexpr std::size_t kShown = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(kShown, runs.size()); ++i) {
    text += fmt::format("{}{}", i == 0 ? "" : ", ", runs[i]);
  }
  return runs.size() > kShown ? text + ", …" : text;
}

void judge_failures(std::span<const RunRecord> records, CampaignSummary& summary) {
  std::vector<std::uint64_t> failed;
  for (const RunRecord& record : records) {
    if (record.outcome == RunOutcome::kFailed) {
      failed.push_back(record.run);
    }
  }
  if (failed.empty()) {
    return;
  }
  const auto reason = std::ranges::max_element(summary.reasons, {}, [](const auto& row) { return row.second; });
  summary.campaign_findings.push_back(
      {"runs-failed", fmt::format("{} of {} runs failed, and are in no statistic.", failed.size(), records.size()),
       fmt::format("runs {}; most often: {}", listed(failed), reason->first),
       "Look at one with --only. If such flights cannot be, narrow the distributions; if they can, the statistics are "
       "too "
       "good.",
       FindingSeverity::kDoNotUse});
}

std::string without_numbers(const std::string& reason) {
  static const std::regex kNumber("-?[0-9][0-9.]*(e[-+]?[0-9]+)?");
  return std::regex_replace(reason, kNumber, "0");
}

std::map<std::string, std::size_t> runs_by_finding(const Records& records) {
  std::map<std::string, std::size_t> runs;
  for (const RunRecord* record : records) {
    for (const std::string& code : std::set<std::string>(record->findings.begin(), record->findings.end())) {
      ++runs[code];
    }
  }
  return runs;
}

void judge_verdicts(CampaignWork work, const Records& trustworthy, const Records& finished, CampaignSummary& summary) {
  Records refused;
  std::ranges::copy_if(finished, std::back_inserter(refused),
                       [](const RunRecord* record) { return record->outcome == RunOutcome::kDoNotUse; });
  if (refused.empty()) {
    return;
  }
  // A finding that trustworthy runs have as well does not tell why runs are refused.
  const std::map<std::string, std::size_t> of_trusted = runs_by_finding(trustworthy);
  std::string why;
  double most = 0;
  for (const auto& [code, count] : runs_by_finding(refused)) {
    const auto trusted = of_trusted.find(code);
    const double share_of_trusted =
        trusted == of_trusted.end() ? 0
                                    : static_cast<double>(trusted->second) / static_cast<double>(trustworthy.size());
    const double more = static_cast<double>(count) - share_of_trusted * static_cast<double>(refused.size());
    if (more > most) {
      most = more;
      why = fmt::format("; most often {}, in {} of these", code, count);
    }
  }
  const bool are_filters = work == CampaignWork::kFilter;
  summary.campaign_findings.push_back(
      {"runs-not-trustworthy",
       fmt::format("{} of {} {}.", refused.size(), finished.size(),
                   are_filters ? "filters began anew on the way, or used too few of the fixes"
                               : "calibrations say of themselves: do not use"),
       fmt::format("{:.1f} % of the runs{}",
                   100.0 * static_cast<double>(refused.size()) / static_cast<double>(finished.size()), why),
       are_filters
           ? "Look at one with --only: there were hardly any fixes, or they contradicted what the filter had found."
           : "Plan for so many passes without a calibration, or for better ones: observe --advise finds slews.",
       trustworthy.empty() ? FindingSeverity::kDoNotUse : FindingSeverity::kWarning});
}

void judge_nees(CampaignWork work, const Records& trustworthy, CampaignSummary& summary) {
  if (!summary.nees) {
    return;
  }
  const Consistency& nees = *summary.nees;
  const double ratio = nees.mean / nees.freedom;
  const std::string evidence =
      fmt::format("mean {:.1f} of {:.0f} over {} runs; a consistent estimator lies within {:.1f} … {:.1f} in 99.9 %",
                  nees.mean, nees.freedom, nees.runs, nees.limit.low * nees.freedom, nees.limit.high * nees.freedom);
  if (ratio > nees.limit.high) {
    const bool matters = nees.sigma_factor() > kMostSigmaFactor;
    summary.campaign_findings.push_back(
        {"nees-above-bounds",
         fmt::format("The sigmas of the parameters are too small, by a factor of {:.2f}.", nees.sigma_factor()),
         evidence,
         "Look at the worst runs and at what matters most: something in these scenarios is not in the estimator's "
         "model.",
         matters ? FindingSeverity::kDoNotUse : FindingSeverity::kWarning});
  } else if (ratio < nees.limit.low) {
    summary.campaign_findings.push_back(
        {"nees-below-bounds",
         fmt::format("The sigmas of the parameters are larger than the errors, by a factor of {:.2f}.",
                     1 / nees.sigma_factor()),
         evidence, "Nothing is unsafe. If accuracy is wanted, compare the prior sigmas with what the scenarios draw.",
         FindingSeverity::kNote});
  }
  std::vector<std::uint64_t> wrong;
  for (const RunRecord* record : trustworthy) {
    const double of_run = record->at(RunQuantity::kNeesFreedom);
    const double value = record->at(RunQuantity::kNees);
    if (of_run > 0 && !(value <= chi_square_quantile(1 - kCertainlyWrong, of_run))) {
      wrong.push_back(record->run);
    }
  }
  if (!wrong.empty()) {
    const bool are_filters = work == CampaignWork::kFilter;
    summary.campaign_findings.push_back(
        {"trusted-but-wrong",
         fmt::format("{} run{}{} {} errors that {} sigmas rule out.", wrong.size(), wrong.size() == 1 ? "" : "s",
                     are_filters ? "" : " called trustworthy", wrong.size() == 1 ? "has" : "have",
                     wrong.size() == 1 ? "its" : "their"),
         fmt::format("{} of {} trustworthy runs have a NEES that chance passes once in a million: run{} {}",
                     wrong.size(), trustworthy.size(), wrong.size() == 1 ? "" : "s", listed(wrong)),
         are_filters ? "Look at them with --only: the model of the filter does not hold there."
                     : "Look at them with --only: their verdict missed something.",
         is_share_above(wrong.size(), trustworthy.size(), kMostWrong) ? FindingSeverity::kDoNotUse
                                                                      : FindingSeverity::kWarning});
  }
}

void judge_nis(CampaignSummary& summary) {
  if (!summary.nis) {
    return;
  }
  const Consistency& nis = *summary.nis;
  const double ratio = nis.mean / nis.freedom;
  if ((ratio > nis.limit.high || ratio < nis.limit.low) && std::abs(nis.sigma_factor() - 1) > kNisMatters) {
    summary.campaign_findings.push_back(
        {"nis-out-of-bounds",
         fmt::format("The innovations are {} than the noise that the estimator goes by, by a factor of {:.3f}.",
                     ratio > 1 ? "larger" : "smaller", nis.sigma_factor()),
         fmt::format("mean {:.3f} of {:.2f}; a consistent estimator lies within {:.3f} … {:.3f} in 99.9 %", nis.mean,
                     nis.freedom, nis.limit.low * nis.freedom, nis.limit.high * nis.freedom),
         "Compare the noise in the scenarios with that in the settings; noise = \"found\" looks for it.",
         FindingSeverity::kWarning});
  }
}

void judge_number(const Records& trustworthy, CampaignSummary& summary) {
  const double highest = kReportedQuantiles.back();
  const std::size_t needed = runs_needed(highest);
  if (trustworthy.empty() || trustworthy.size() >= needed) {
    return;
  }
  summary.campaign_findings.push_back(
      {"too-few-runs",
       fmt::format("{} trustworthy runs do not support the quantile of {:.1f} %.", trustworthy.size(), 100 * highest),
       fmt::format(
           "at {:.0f} % confidence their largest value bounds the quantile of {:.1f} %; for {:.1f} % it takes {} "
           "runs",
           100 * kConfidence, std::floor(1000 * quantile_supported(trustworthy.size())) / 10, 100 * highest, needed),
       fmt::format("For the quantile of {:.1f} % let {} runs be trustworthy.", 100 * highest, needed),
       FindingSeverity::kNote});
}

}  // namespace

std::string influential(const CampaignInput& input) {
  return input.is_number() ? input.key : fmt::format("{} = {}", input.key, input.options.back());
}

std::span<const Measure> measures() { return kMeasures; }

std::span<const std::string_view> cell_measures(CampaignWork work) {
  static constexpr std::array<std::string_view, 3> kOfCalibrations = {"alignment_error", "open_loop_error",
                                                                      "extension"};
  static constexpr std::array<std::string_view, 2> kOfFilters = {"alignment_error", "attitude_rms"};
  return work == CampaignWork::kFilter ? std::span<const std::string_view>(kOfFilters) : kOfCalibrations;
}

Consistency consistency_of(double sum, double freedom, double count) {
  return {.freedom = freedom / count,
          .mean = sum / count,
          .usual = chi_square_bounds(freedom, kUsual),
          .limit = chi_square_bounds(freedom, kLimit)};
}

std::string text_of_draw(const CampaignInput& input, double draw) {
  return input.is_number() ? fmt::format("{:.6g}{}", input.shown(draw), input.unit)
                           : input.options[static_cast<std::size_t>(draw)];
}

double Consistency::sigma_factor() const { return std::sqrt(mean / freedom); }

int Consistency::side() const { return mean < usual.low * freedom ? -1 : mean <= usual.high * freedom ? 0 : 1; }

std::optional<double> quantile_of(const MeasureStatistics& statistics, double p) {
  const auto found = std::ranges::find(statistics.quantiles, p, &QuantileBounds::p);
  return found != statistics.quantiles.end() ? std::optional(found->estimate) : std::nullopt;
}

bool CampaignSummary::trustworthy_campaign() const {
  return std::ranges::find(campaign_findings, FindingSeverity::kDoNotUse, &CampaignFinding::severity) ==
         campaign_findings.end();
}

CampaignSummary summarise(const CampaignPlan& plan, std::span<const RunRecord> records) {
  CampaignSummary summary;
  Records finished;
  Records trustworthy;
  std::map<std::string, std::string> first_of_its_kind;  // reasons, by what they have beside numbers
  for (const RunRecord& record : records) {
    ++summary.outcomes[static_cast<std::size_t>(record.outcome)];
    if (record.outcome == RunOutcome::kFailed) {
      ++summary.reasons[first_of_its_kind.try_emplace(without_numbers(record.reason), record.reason).first->second];
      continue;
    }
    finished.push_back(&record);
    if (record.outcome == RunOutcome::kTrustworthy) {
      trustworthy.push_back(&record);
    }
  }
  summary.findings = runs_by_finding(finished);
  summary.nees = nees_of(trustworthy);
  summary.nees_of_all = nees_of(finished);
  summary.nis = nis_of(trustworthy);
  for (const Measure& measure : kMeasures) {
    summary.trustworthy.push_back(statistics_of(measure, trustworthy));
    summary.all.push_back(statistics_of(measure, finished));
  }
  summary.parameters = errors_of_parameters(plan.gyros, trustworthy);
  find_influences(plan, finished, summary);
  find_cells(plan, records, summary);
  find_worst(records, finished, summary);
  judge_failures(records, summary);
  judge_verdicts(plan.work, trustworthy, finished, summary);
  judge_nees(plan.work, trustworthy, summary);
  judge_nis(summary);
  judge_number(trustworthy, summary);
  return summary;
}

}  // namespace trihedron::campaign
