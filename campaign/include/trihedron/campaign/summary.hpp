#pragma once
/// What the runs of a campaign say together: whether sigmas are honest, how large errors are, what matters.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/campaign/statistics.hpp"
#include "trihedron/records/campaign.hpp"
#include "trihedron/records/finding.hpp"

namespace trihedron::campaign {

/// One number of a run that is looked at over all runs.
struct Measure {
  enum class Unit : std::uint8_t { kRadian, kSecond, kRatio, kNone };
  std::string_view key;    ///< for programs
  std::string_view label;  ///< for people
  std::string_view about;  ///< what it is, as a sentence without its stop
  Unit unit = Unit::kNone;
  bool large_is_bad = true;
  /// NaN where a run has none; infinity where it did not get there.
  double (*of)(const RunRecord& record) = nullptr;
  /// Whether that is a lower bound: the pass ended before. Null where it never is.
  bool (*is_lower_bound)(const RunRecord& record) = nullptr;
};

/// nees, alignment_error (largest of all gyros), attitude_rms, navigation_error, corrected_error, open_loop_error,
/// open_loop_error_to_end, drift_settled, alignment_settled, interval_after, extension.
[[nodiscard]] std::span<const Measure> measures();

/// Quantiles that are reported of each measure.
inline constexpr std::array<double, 4> kReportedQuantiles = {0.5, 0.9, 0.95, 0.997};

/// A measure over runs.
struct MeasureStatistics {
  const Measure* measure = nullptr;
  std::size_t runs = 0;  ///< that have it
  /// For a measure of which small is bad the quantiles are counted from above: that which so many runs reach.
  std::vector<QuantileBounds> quantiles;  ///< by kReportedQuantiles; empty where no run has it
};

/// Sums of squared errors by their covariance, over runs or fixes.
struct Consistency {
  std::size_t runs = 0;
  double freedom = 0;  ///< degrees of freedom of one, mean over the runs
  double mean = 0;     ///< of one
  /// That hold the mean of a consistent estimator in 95 % and in 99.9 % of such campaigns.
  ChiSquareBounds usual{};
  ChiSquareBounds limit{};
  double within = 0;  ///< share of the runs within the 95 % of their own χ²

  /// By which the sigmas would have to be multiplied.
  [[nodiscard]] double sigma_factor() const;
  /// −1 where the mean is below `usual`, 1 where it is above or no number.
  [[nodiscard]] int side() const;
};

/// Of a sum of χ² with so many degrees of freedom together, over `count` runs or fixes. Without `runs` and `within`.
[[nodiscard]] Consistency consistency_of(double sum, double freedom, double count);

/// The errors of one parameter.
struct ParameterErrors {
  std::string name;  ///< "gyro1.k0"
  bool is_alignment = false;
  std::size_t runs = 0;
  double rms = 0;           ///< rad/s or rad
  double sigma = 0;         ///< rms of those claimed
  double normalised = 0;    ///< rms of error/sigma: 1 for honest sigmas
  ChiSquareBounds usual{};  ///< of `normalised`, that hold 95 %
};

/// Its estimate of one of kReportedQuantiles; nothing where no run has the measure.
[[nodiscard]] std::optional<double> quantile_of(const MeasureStatistics& statistics, double p);

/// How a value that was drawn and a measure go together.
struct Influence {
  std::size_t input = 0;  ///< of CampaignPlan::inputs
  const Measure* measure = nullptr;
  /// Of runs; for a value of the scenario, of flights, each with the mean of its runs by all settings: runs of one
  /// flight are not independent.
  RankCorrelation correlation;
  bool is_significant = false;  ///< by chance in 5 % of campaigns at most one of all pairs would be
};

/// The key of an input that has influences; of two words with the second, whose correlation it is.
[[nodiscard]] std::string influential(const CampaignInput& input);

/// A run that an analyst should look at.
struct WorstRun {
  std::uint64_t run = 0;
  std::string why;
  const Measure* measure = nullptr;  ///< null for a run that failed
  double value = 0;
};

/// Something that a user of the campaign must know.
struct CampaignFinding {
  std::string code;
  std::string text;
  std::string evidence;
  std::string cure;
  FindingSeverity severity = FindingSeverity::kWarning;
};

/// The runs at one point of the grids.
struct GridCell {
  std::vector<double> point;  ///< by CampaignSummary::grid: the place of an option
  std::size_t failed = 0;
  std::size_t finished = 0;  ///< all that did not fail
  std::size_t trustworthy = 0;
  std::optional<Consistency> nees;  ///< of trustworthy runs, as all that follows
  std::optional<Consistency> nis;
  std::vector<MeasureStatistics> measures;  ///< by cell_measures()
};
/// Keys of measures() that are shown for each cell: what runs of this work have.
[[nodiscard]] std::span<const std::string_view> cell_measures(CampaignWork work);
/// Quantile of them that is shown.
inline constexpr double kCellQuantile = 0.95;

/// What the runs of a campaign say together.
struct CampaignSummary {
  std::array<std::size_t, 3> outcomes{};        ///< by RunOutcome
  std::map<std::string, std::size_t> findings;  ///< runs by the codes of their findings
  /// Runs that failed, by the reason: by the first of those that differ in numbers alone.
  std::map<std::string, std::size_t> reasons;
  std::optional<Consistency> nees;             ///< of trustworthy runs
  std::optional<Consistency> nees_of_all;      ///< of all that did not fail
  std::optional<Consistency> nis;              ///< of trustworthy runs
  std::vector<MeasureStatistics> trustworthy;  ///< by measures(): of trustworthy runs
  std::vector<MeasureStatistics> all;          ///< of all that did not fail
  std::vector<ParameterErrors> parameters;     ///< of trustworthy runs
  std::vector<Influence> influences;           ///< strongest first; of all that did not fail
  std::size_t pairs = 0;                       ///< that were looked at for an influence
  std::vector<WorstRun> worst;
  std::vector<std::size_t> grid;  ///< of CampaignPlan::inputs the grids of several values
  std::vector<GridCell> cells;    ///< in the order of the runs; empty without a grid, or with one run at each point
  std::vector<CampaignFinding> campaign_findings;

  [[nodiscard]] std::size_t count(RunOutcome outcome) const { return outcomes[static_cast<std::size_t>(outcome)]; }
  /// Whether no finding says "do not use".
  [[nodiscard]] bool trustworthy_campaign() const;
};

/// What was drawn, as people read it: a number in its unit, or a word.
[[nodiscard]] std::string text_of_draw(const CampaignInput& input, double draw);

/// records: of this plan, in the order of their numbers.
[[nodiscard]] CampaignSummary summarise(const CampaignPlan& plan, std::span<const RunRecord> records);

}  // namespace trihedron::campaign
