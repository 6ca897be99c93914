#pragma once
/// An attitude measured against the best reference that a pass has.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "trihedron/ground/evaluate/evaluate.hpp"
#include "trihedron/records/run.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::ground {

/// What an attitude is compared with: the truth where there is one, or else fixes of the first star tracker.
enum class ReferenceKind : std::uint8_t { kTruth, kStarTracker };

/// "truth", "star tracker"
[[nodiscard]] constexpr std::string_view name_of(ReferenceKind kind) {
  return kind == ReferenceKind::kTruth ? "truth" : "star tracker";
}

/// Attitude error that ends a correction interval, unless the user says otherwise: 5′.
inline constexpr double kAttitudeLimit_rad = 5 * kArcminute;

/// Over stretches of this length from the epoch of the pass, the correction interval of the paper, errors are summed
/// up.
inline constexpr Duration kEvaluatedStretch = std::chrono::minutes(90);

/// Errors of an attitude against a reference. The sigmas are those of the difference: of the attitude and, where fixes
/// are the reference, of their noise.
struct AttitudeEvaluation {
  ReferenceKind reference = ReferenceKind::kTruth;
  AttitudeErrors errors;
  ErrorStatistics whole;
  std::vector<ErrorStatistics> stretches;  ///< of kEvaluatedStretch
  double limit_rad = kAttitudeLimit_rad;
  std::vector<CorrectionInterval> intervals;  ///< empty where the attitude does not tell its corrections
};

/// Sums up errors. `epoch`: of the pass.
[[nodiscard]] AttitudeEvaluation summed_up(AttitudeErrors errors, ReferenceKind reference, Time epoch,
                                           double limit_rad);

/// An attitude from wherever, against the truth, which may be null, or else against all fixes.
[[nodiscard]] AttitudeEvaluation evaluate_attitude(const Pass& pass, const AttitudeHistory& attitude,
                                                   const Truth* truth, double limit_rad = kAttitudeLimit_rad);

/// The attitude of a navigation, against the truth, which may be null, or else against the fixes that it used.
[[nodiscard]] AttitudeEvaluation evaluate_navigation(const Pass& pass, const NavigationRun& run, const Truth* truth,
                                                     double limit_rad = kAttitudeLimit_rad);

/// How much longer the attitude holds with calibrated parameters than with those known before.
struct IntervalExtension {
  std::vector<IntervalPair> pairs;  ///< one for each correction
  std::optional<Extension> median;
};

/// By two attitudes of the same pass; corrections that only one of them has are left out.
[[nodiscard]] IntervalExtension extension_between(const AttitudeEvaluation& known_before,
                                                  const AttitudeEvaluation& calibrated);

}  // namespace trihedron::ground
