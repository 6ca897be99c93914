#pragma once
/// A Monte Carlo campaign: what is drawn for each run, and what came of it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/records/scenario.hpp"

namespace trihedron {

/// Keys that begin so are settings of the calibration; all others are of the scenario.
inline constexpr std::string_view kSettingKeys = "calibration.";

/// How a value of the scenario, or a setting, is drawn. `a` and `b`, `least` and `most` are in the unit of
/// CampaignInput.
struct Distribution {
  enum class Kind : std::uint8_t {
    kUniform,     ///< from a to b
    kLoguniform,  ///< its logarithm is uniform between those of a and b
    kNormal,      ///< mean a, 1-sigma b
    kLognormal,   ///< its logarithm is normal: median a, 1-sigma a factor b
    kChoice,      ///< one of the options, by their weights
    kGrid,        ///< each of the options in turn
    kFollows      ///< a times what is drawn for another input
  };
  Kind kind = Kind::kUniform;
  double a = 0;
  double b = 0;
  double least = 0;               ///< nothing below is drawn
  double most = 0;                ///< nothing above is drawn
  std::vector<double> weights{};  ///< of kChoice, one per option, above zero
  std::size_t options = 0;        ///< of kChoice and kGrid

  [[nodiscard]] bool has_options() const { return kind == Kind::kChoice || kind == Kind::kGrid; }
};

/// A value of the scenario, or a setting of the calibration, that is not the same in all runs.
struct CampaignInput {
  /// Its path: of a scenario "gyro.readout.noise", "gyro.unit.2.drift.prior_sigma", of a setting
  /// "calibration.estimator".
  std::string key;
  Distribution distribution;
  std::string unit;                  ///< as the campaign file has it: "arcsec"; empty where there is none
  std::vector<std::string> options;  ///< of kChoice and kGrid, as the file has or names them
  std::vector<double> numbers;       ///< the same as numbers in `unit`; empty where one is none
  std::size_t followed = 0;          ///< of kFollows: which input, of numbers, that follows none itself

  /// Whether it is a setting: it then leaves the flight as it is.
  [[nodiscard]] bool is_setting() const { return key.starts_with(kSettingKeys); }
  /// Whether its draws have an order: false for words.
  [[nodiscard]] bool is_number() const { return !distribution.has_options() || !numbers.empty(); }
  /// What was drawn, as people read it: a number in `unit`, or for words their place among the options.
  [[nodiscard]] double shown(double draw) const {
    return distribution.has_options() && !numbers.empty() ? numbers[static_cast<std::size_t>(draw)] : draw;
  }
};

/// What a run is measured by; kRunQuantityRows has their names.
enum class RunQuantity : std::uint8_t {
  kNees,
  kNeesFreedom,
  kNisMean,
  kNisFreedom,
  kNisFixes,
  kNisMeanOfAll,
  kNisFixesOfAll,
  kDriftError,
  kDriftSigma,
  kAlignmentError,
  kAlignmentSigma,
  kCovariance,
  kAttitudeRms,
  kAttitudeNormalisedSquare,
  kNavigationError,
  kCorrectedError,
  kOpenLoopError,
  kOpenLoopErrorBefore,
  kOpenLoopErrorToEnd,
  kDriftSettled,
  kAlignmentSettled,
  kIntervalBefore,
  kIntervalAfter,
  kIntervalAfterIsLowerBound,
  kExtension,
  kExtensionIsLowerBound,
};
inline constexpr std::size_t kRunQuantities = 26;

/// How many values a quantity has in each run, and in which order.
enum class RunShape : std::uint8_t { kOne, kAxis, kQuantile, kGyroAndAxis, kGyroAndCoefficient, kTwoParameters };

/// Quantiles of the errors of a run's epochs. The last is the largest error.
inline constexpr std::array<double, 4> kErrorQuantiles = {0.5, 0.95, 0.997, 1};

/// Drift coefficients of eq. (1).
inline constexpr std::size_t kCampaignCoefficients = 7;
/// Parameters of a gyro: these and the alignment about c x, y, z.
inline constexpr std::size_t kCampaignParameters = kCampaignCoefficients + 3;

/// A quantity, its name in files, its UDUNITS unit and what it is.
struct RunQuantityRow {
  RunQuantity quantity;
  std::string_view name;
  RunShape shape;
  std::string_view unit;
  std::string_view about;
};
inline constexpr std::array<RunQuantityRow, kRunQuantities> kRunQuantityRows = {{
    {RunQuantity::kNees, "nees", RunShape::kOne, "1",
     "squared error of the coefficients of eq. (1) and of the alignments of all gyros, by their covariance"},
    {RunQuantity::kNeesFreedom, "nees_degrees_of_freedom", RunShape::kOne, "1", "parameters that nees is over"},
    {RunQuantity::kNisMean, "nis_mean", RunShape::kOne, "1", "mean squared innovation of a fix by its covariance"},
    {RunQuantity::kNisFreedom, "nis_degrees_of_freedom", RunShape::kOne, "1", "mean degrees of freedom of a fix"},
    {RunQuantity::kNisFixes, "nis_fixes", RunShape::kOne, "1", "fixes that nis_mean is over"},
    {RunQuantity::kNisMeanOfAll, "nis_mean_of_all", RunShape::kOne, "1",
     "the same over all fixes but the first: those as well that were rejected or that made the filter begin anew"},
    {RunQuantity::kNisFixesOfAll, "nis_fixes_of_all", RunShape::kOne, "1", "fixes that nis_mean_of_all is over"},
    {RunQuantity::kDriftError, "drift_error", RunShape::kGyroAndCoefficient, "rad s-1",
     "error of the coefficients of eq. (1), estimate - truth"},
    {RunQuantity::kDriftSigma, "drift_sigma", RunShape::kGyroAndCoefficient, "rad s-1", "its 1-sigma"},
    {RunQuantity::kAlignmentError, "alignment_error", RunShape::kGyroAndAxis, "rad",
     "error of the alignment, estimate - truth, small rotation about c axes"},
    {RunQuantity::kAlignmentSigma, "alignment_sigma", RunShape::kGyroAndAxis, "rad", "its 1-sigma"},
    {RunQuantity::kCovariance, "covariance", RunShape::kTwoParameters, "1",
     "covariance of these errors in SI units, coefficients and then alignment of each gyro in turn"},
    {RunQuantity::kAttitudeRms, "attitude_rms", RunShape::kAxis, "rad",
     "rms error of the attitude of the calibration, about c axes: roll, pitch, heading"},
    {RunQuantity::kAttitudeNormalisedSquare, "attitude_normalised_square", RunShape::kOne, "1",
     "mean of (error/sigma)^2 of that attitude, 1 for honest sigmas"},
    {RunQuantity::kNavigationError, "navigation_error", RunShape::kQuantile, "rad",
     "error of the navigator, which is corrected every 90 min, from the second correction on"},
    {RunQuantity::kCorrectedError, "corrected_error", RunShape::kOne, "rad",
     "largest error of the navigator at the first epoch after a correction, from the second on"},
    {RunQuantity::kOpenLoopError, "open_loop_error", RunShape::kOne, "rad",
     "largest error within 90 min of an open loop with calibrated parameters, from the second correction on"},
    {RunQuantity::kOpenLoopErrorBefore, "open_loop_error_before", RunShape::kOne, "rad",
     "the same with the parameters known before the pass"},
    {RunQuantity::kOpenLoopErrorToEnd, "open_loop_error_to_end", RunShape::kOne, "rad",
     "largest error of these open loops with calibrated parameters up to the end of the pass"},
    {RunQuantity::kDriftSettled, "drift_settled", RunShape::kOne, "s",
     "time since the start after which all determined coefficients have settled"},
    {RunQuantity::kAlignmentSettled, "alignment_settled", RunShape::kOne, "s",
     "time since the start after which all determined alignments have settled"},
    {RunQuantity::kIntervalBefore, "interval_before", RunShape::kOne, "s",
     "median correction interval with the parameters known before the pass, from the second correction on"},
    {RunQuantity::kIntervalAfter, "interval_after", RunShape::kOne, "s",
     "median correction interval with calibrated parameters, from the second correction on"},
    {RunQuantity::kIntervalAfterIsLowerBound, "interval_after_is_lower_bound", RunShape::kOne, "1",
     "1 where the error limit was not reached while it was watched"},
    {RunQuantity::kExtension, "extension", RunShape::kOne, "1",
     "median ratio of the correction interval with calibrated parameters to that with those known before"},
    {RunQuantity::kExtensionIsLowerBound, "extension_is_lower_bound", RunShape::kOne, "1",
     "1 where the error limit was not reached while it was watched"},
}};

/// Its row in the table.
[[nodiscard]] constexpr const RunQuantityRow& row_of(RunQuantity quantity) {
  return kRunQuantityRows[static_cast<std::size_t>(quantity)];
}

/// Values of a quantity in one run.
[[nodiscard]] constexpr std::size_t size_of(RunShape shape, std::size_t gyros) {
  switch (shape) {
    case RunShape::kOne:
      return 1;
    case RunShape::kAxis:
      return 3;
    case RunShape::kQuantile:
      return kErrorQuantiles.size();
    case RunShape::kGyroAndAxis:
      return 3 * gyros;
    case RunShape::kGyroAndCoefficient:
      return kCampaignCoefficients * gyros;
    case RunShape::kTwoParameters:
      return kCampaignParameters * gyros * kCampaignParameters * gyros;
  }
  return 0;
}

/// What a run of a campaign does with what it has simulated.
enum class CampaignWork : std::uint8_t {
  kCalibrate,  ///< all that `calibrate` does, with verdict, navigator and open loops
  kFilter,     ///< the filter alone: coefficients, alignments and the attitude at each fix, compared with the truth
};

/// What a campaign does, apart from its base scenario and the settings of the calibration.
struct CampaignPlan {
  std::string name;
  std::uint64_t seed = 0;
  std::uint64_t runs = 0;     ///< flights × points of the grids over settings
  std::uint64_t repeats = 1;  ///< runs at each point of a grid
  bool latin_hypercube = false;
  CampaignWork work = CampaignWork::kCalibrate;
  double limit_rad = 5 * kArcminute;  ///< attitude error that ends a correction interval
  bool keeps_covariance = false;      ///< RunQuantity::kCovariance, which is larger than all others together
  std::vector<CampaignInput> inputs;
  std::size_t gyros = 2;  ///< of the base scenario

  /// Whether its runs have this quantity.
  [[nodiscard]] bool has(RunQuantity quantity) const {
    return (keeps_covariance || quantity != RunQuantity::kCovariance) &&
           (work == CampaignWork::kCalibrate || quantity <= RunQuantity::kAttitudeNormalisedSquare);
  }
};

/// Whether a run came to its end, and what it thought of its result.
enum class RunOutcome : std::uint8_t { kTrustworthy, kDoNotUse, kFailed };

/// "trustworthy", "do_not_use", "failed"
[[nodiscard]] constexpr std::string_view name_of(RunOutcome outcome) {
  constexpr std::array<std::string_view, 3> kNames = {"trustworthy", "do_not_use", "failed"};
  return kNames[static_cast<std::size_t>(outcome)];
}

/// A row of the table of runs.
struct RunRecord {
  std::uint64_t run = 0;
  std::uint64_t seed = 0;     ///< of its scenario
  std::vector<double> draws;  ///< one per input: a number in its unit, or the place of an option
  RunOutcome outcome = RunOutcome::kFailed;
  std::string reason;                 ///< of a failure
  std::string drift_model;            ///< that was used; empty where it failed
  std::vector<std::string> findings;  ///< codes, in the order of the verdict
  /// By RunQuantity; NaN where there is none.
  std::array<std::vector<double>, kRunQuantities> values;

  // Not repeatable: not part of the table.
  double cpu_s = 0;      ///< of its thread
  double elapsed_s = 0;  ///< by the clock

  [[nodiscard]] std::vector<double>& operator[](RunQuantity quantity) {
    return values[static_cast<std::size_t>(quantity)];
  }
  [[nodiscard]] const std::vector<double>& operator[](RunQuantity quantity) const {
    return values[static_cast<std::size_t>(quantity)];
  }
  /// One of its values; NaN where there is none.
  [[nodiscard]] double at(RunQuantity quantity, std::size_t i = 0) const {
    const std::vector<double>& all = (*this)[quantity];
    return i < all.size() ? all[i] : std::numeric_limits<double>::quiet_NaN();
  }
};

/// What a campaign depends on, one text per key: two campaigns are the same where all texts are.
struct IdentityLine {
  std::string key;
  std::string text;

  friend bool operator==(const IdentityLine& a, const IdentityLine& b) = default;
};
using CampaignIdentity = std::vector<IdentityLine>;

}  // namespace trihedron
