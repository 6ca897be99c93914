#pragma once
/// What a user of a result must know.

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trihedron {

/// What a finding says; the names are in kFindings.
enum class FindingCode : std::uint8_t {
  kTooFewFixes,
  kShortPass,
  kManyRejected,
  kReopened,
  kSigmasWidened,
  kBatchNotConverged,
  kStarTrackerOff,
  kStarTrackerFrozen,
  kGyroIsolated,
  kGyroStuck,
  kGyroLeapt,
  kErrorsBesideOutages,
  kCorrelatedFixes,
  kFixCovariancesTooSmall,
  kGyroContradicted,
  kGyroSamplesThinned,
  kGyroSamplesFarApart,
  kNisOutOfBounds,
  kInnovationsNotWhite,
  kOrbitalLine,
  kHalvesDisagree,
  kDriftModelTooSmall,
  kDriftModelTooLarge,
  kDriftModelAtItsLimit,
  kCoefficientsChanged,
  kGyroMountingMoved,
  kStarTrackerMoved,
  kMomentumJumped,
  kInertialAxesTurned,
  kCoefficientsNotConstant,
  kAberrationNotCorrected,
  kStarTrackerWanders,
  kStarTrackerErrorsNotNormal,
  kFixesWorseInSlews,
  kStarTrackerErrorsNotShown,
  kReadoutScaleOff,
  kReadoutErrorByDirection,
  kClockOffsetFound,
  kClockRateFound,
  kClocksApart,
  kClockStepped,
  kGyroLate,
  kGyroClockRate,
  kGyroStampsScatter,
  kOrbitalErrorFound,
  kOrbitalDriftFound,
  kOrbitalErrorOrDrift,
  kPolhodeFound,
  kStarTrackerNoise,
  kReadoutNoise,
  kGyroReadingsWrong,
  kNotDetermined,
  kPriorContradicted,
  kWeakAlignmentAxis,
  kGyrosNotUsed,
  kStarTrackersNotUsed,
  kPairBadlyPlaced,
  kCalibrationDoesNotFit,
  kCalibrationNotTrustworthy,
  kCalibrationOfAnotherTime,
  kAttitudeIncomplete,
  kCorrectionsMissed,
  kAttitudeOffFixes,
  kAlignmentMoved,
  kCoefficientsMoved,
  kPassNotTrustworthy,
  kNotAdopted,
  kApplicationFailed,
  kNeedNotMet,
  kDriftNotExplained,
  kOther,  ///< of a file, from a program that knows more
};

/// What follows from a finding: nothing, care, or that the result must not be used.
enum class FindingSeverity : std::uint8_t { kNote, kWarning, kDoNotUse };

/// A severity and its name.
struct FindingSeverityRow {
  FindingSeverity severity;
  std::string_view name;  ///< in calibration.json
};
inline constexpr std::array<FindingSeverityRow, 3> kFindingSeverities = {{{FindingSeverity::kNote, "note"},
                                                                          {FindingSeverity::kWarning, "warning"},
                                                                          {FindingSeverity::kDoNotUse, "do-not-use"}}};

/// Its name in the table.
[[nodiscard]] constexpr std::string_view name_of(FindingSeverity severity) {
  return kFindingSeverities[static_cast<std::size_t>(severity)].name;
}

/// A finding, its name and its usual severity.
struct FindingRow {
  FindingCode code;
  std::string_view name;     ///< stable, for programs
  FindingSeverity severity;  ///< where the one who finds it does not say otherwise
};
inline constexpr auto kFindings = std::to_array<FindingRow>({
    {FindingCode::kTooFewFixes, "too-few-fixes", FindingSeverity::kDoNotUse},
    {FindingCode::kShortPass, "short-pass", FindingSeverity::kWarning},
    {FindingCode::kManyRejected, "many-rejected", FindingSeverity::kWarning},
    {FindingCode::kReopened, "reopened", FindingSeverity::kWarning},
    {FindingCode::kSigmasWidened, "sigmas-widened", FindingSeverity::kWarning},
    {FindingCode::kBatchNotConverged, "batch-not-converged", FindingSeverity::kDoNotUse},
    {FindingCode::kStarTrackerOff, "star-tracker-off", FindingSeverity::kWarning},
    {FindingCode::kStarTrackerFrozen, "star-tracker-frozen", FindingSeverity::kWarning},
    {FindingCode::kGyroIsolated, "gyro-isolated", FindingSeverity::kWarning},
    {FindingCode::kGyroStuck, "gyro-stuck", FindingSeverity::kWarning},
    {FindingCode::kGyroLeapt, "gyro-leapt", FindingSeverity::kWarning},
    {FindingCode::kErrorsBesideOutages, "errors-beside-outages", FindingSeverity::kWarning},
    {FindingCode::kCorrelatedFixes, "correlated-fixes", FindingSeverity::kNote},
    {FindingCode::kFixCovariancesTooSmall, "fix-covariances-too-small", FindingSeverity::kDoNotUse},
    {FindingCode::kGyroContradicted, "gyro-contradicted", FindingSeverity::kDoNotUse},
    {FindingCode::kGyroSamplesThinned, "gyro-samples-thinned", FindingSeverity::kNote},
    {FindingCode::kGyroSamplesFarApart, "gyro-samples-far-apart", FindingSeverity::kWarning},
    {FindingCode::kNisOutOfBounds, "nis-out-of-bounds", FindingSeverity::kWarning},
    {FindingCode::kInnovationsNotWhite, "innovations-not-white", FindingSeverity::kWarning},
    {FindingCode::kOrbitalLine, "orbital-line", FindingSeverity::kWarning},
    {FindingCode::kHalvesDisagree, "halves-disagree", FindingSeverity::kDoNotUse},
    {FindingCode::kDriftModelTooSmall, "drift-model-too-small", FindingSeverity::kDoNotUse},
    {FindingCode::kDriftModelTooLarge, "drift-model-too-large", FindingSeverity::kWarning},
    {FindingCode::kDriftModelAtItsLimit, "drift-model-at-its-limit", FindingSeverity::kWarning},
    {FindingCode::kCoefficientsChanged, "coefficients-changed", FindingSeverity::kWarning},
    {FindingCode::kGyroMountingMoved, "gyro-mounting-moved", FindingSeverity::kDoNotUse},
    {FindingCode::kStarTrackerMoved, "star-tracker-moved", FindingSeverity::kDoNotUse},
    {FindingCode::kMomentumJumped, "momentum-jumped", FindingSeverity::kDoNotUse},
    {FindingCode::kInertialAxesTurned, "inertial-axes-turned", FindingSeverity::kDoNotUse},
    {FindingCode::kCoefficientsNotConstant, "coefficients-not-constant", FindingSeverity::kDoNotUse},
    {FindingCode::kAberrationNotCorrected, "aberration-not-corrected", FindingSeverity::kDoNotUse},
    {FindingCode::kStarTrackerWanders, "star-tracker-wanders", FindingSeverity::kDoNotUse},
    {FindingCode::kStarTrackerErrorsNotNormal, "star-tracker-errors-not-normal", FindingSeverity::kDoNotUse},
    {FindingCode::kFixesWorseInSlews, "fixes-worse-in-slews", FindingSeverity::kWarning},
    {FindingCode::kStarTrackerErrorsNotShown, "star-tracker-errors-not-shown", FindingSeverity::kWarning},
    {FindingCode::kReadoutScaleOff, "readout-scale-off", FindingSeverity::kDoNotUse},
    {FindingCode::kReadoutErrorByDirection, "readout-error-by-direction", FindingSeverity::kDoNotUse},
    {FindingCode::kClockOffsetFound, "clock-offset-found", FindingSeverity::kNote},
    {FindingCode::kClockRateFound, "clock-rate-found", FindingSeverity::kNote},
    {FindingCode::kClocksApart, "clocks-apart", FindingSeverity::kDoNotUse},
    {FindingCode::kClockStepped, "clock-stepped", FindingSeverity::kDoNotUse},
    {FindingCode::kGyroLate, "gyro-late", FindingSeverity::kWarning},
    {FindingCode::kGyroClockRate, "gyro-clock-rate", FindingSeverity::kDoNotUse},
    {FindingCode::kGyroStampsScatter, "gyro-stamps-scatter", FindingSeverity::kWarning},
    {FindingCode::kOrbitalErrorFound, "orbital-error-found", FindingSeverity::kNote},
    {FindingCode::kOrbitalDriftFound, "orbital-drift-found", FindingSeverity::kNote},
    {FindingCode::kOrbitalErrorOrDrift, "orbital-error-or-drift", FindingSeverity::kDoNotUse},
    {FindingCode::kPolhodeFound, "polhode-found", FindingSeverity::kNote},
    {FindingCode::kStarTrackerNoise, "star-tracker-noise", FindingSeverity::kWarning},
    {FindingCode::kReadoutNoise, "readout-noise", FindingSeverity::kWarning},
    {FindingCode::kGyroReadingsWrong, "gyro-readings-wrong", FindingSeverity::kWarning},
    {FindingCode::kNotDetermined, "not-determined", FindingSeverity::kWarning},
    {FindingCode::kPriorContradicted, "prior-contradicted", FindingSeverity::kDoNotUse},
    {FindingCode::kWeakAlignmentAxis, "weak-alignment-axis", FindingSeverity::kDoNotUse},
    {FindingCode::kGyrosNotUsed, "gyros-not-used", FindingSeverity::kNote},
    {FindingCode::kStarTrackersNotUsed, "star-trackers-not-used", FindingSeverity::kNote},
    {FindingCode::kPairBadlyPlaced, "pair-badly-placed", FindingSeverity::kWarning},
    {FindingCode::kCalibrationDoesNotFit, "calibration-does-not-fit", FindingSeverity::kDoNotUse},
    {FindingCode::kCalibrationNotTrustworthy, "calibration-not-trustworthy", FindingSeverity::kDoNotUse},
    {FindingCode::kCalibrationOfAnotherTime, "calibration-of-another-time", FindingSeverity::kWarning},
    {FindingCode::kAttitudeIncomplete, "attitude-incomplete", FindingSeverity::kWarning},
    {FindingCode::kCorrectionsMissed, "corrections-missed", FindingSeverity::kWarning},
    {FindingCode::kAttitudeOffFixes, "attitude-off-fixes", FindingSeverity::kWarning},
    {FindingCode::kAlignmentMoved, "alignment-moved", FindingSeverity::kWarning},
    {FindingCode::kCoefficientsMoved, "coefficients-moved", FindingSeverity::kDoNotUse},
    {FindingCode::kPassNotTrustworthy, "pass-not-trustworthy", FindingSeverity::kDoNotUse},
    {FindingCode::kNotAdopted, "not-adopted", FindingSeverity::kDoNotUse},
    {FindingCode::kApplicationFailed, "application-failed", FindingSeverity::kDoNotUse},
    {FindingCode::kNeedNotMet, "need-not-met", FindingSeverity::kDoNotUse},
    {FindingCode::kDriftNotExplained, "drift-not-explained", FindingSeverity::kWarning},
    {FindingCode::kOther, "other", FindingSeverity::kWarning},
});

/// Its row in the table.
[[nodiscard]] constexpr const FindingRow& row_of(FindingCode code) { return kFindings[static_cast<std::size_t>(code)]; }
/// Its name in the table.
[[nodiscard]] constexpr std::string_view name_of(FindingCode code) { return row_of(code).name; }
/// kOther for a name that this program does not know.
[[nodiscard]] constexpr FindingCode finding_code_named(std::string_view name) {
  const auto* const row = std::ranges::find(kFindings, name, &FindingRow::name);
  return row == kFindings.end() ? FindingCode::kOther : row->code;
}

/// One thing that a user of the result must know.
struct Finding {
  using Severity = FindingSeverity;
  FindingCode code = FindingCode::kOther;
  std::string text;      ///< for people: what was seen
  std::string evidence;  ///< the numbers behind it
  std::string cure;      ///< what to do about it
  Severity severity = row_of(code).severity;
};

/// Whether a result may be used, and everything that was found.
struct Verdict {
  bool trustworthy = false;
  std::vector<Finding> findings;

  [[nodiscard]] bool has(FindingCode code) const {
    return std::ranges::find(findings, code, &Finding::code) != findings.end();
  }
};

}  // namespace trihedron
