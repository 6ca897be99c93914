#pragma once
/// Attitude error against a reference: roll, pitch, heading; per stretch of time; after each correction.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Errors, solution − reference, at the epochs common to both, within half a millisecond: e of C_in_c(solution) =
/// C_in_c(ref) exp([e×]), c axes.
struct AttitudeErrors {
  std::vector<Time> t;
  std::vector<Eigen::Vector3d> error_rad;  ///< x roll, y pitch, z heading
  std::vector<Eigen::Vector3d> sigma_rad;  ///< as the solution claims; empty where it claims none
  std::vector<double> age_s;               ///< time since the last astro-correction; empty where unknown
};

/// Errors of `solution` against a reference attitude given at times `reference_t`.
[[nodiscard]] AttitudeErrors attitude_errors(const AttitudeHistory& solution, const std::vector<Time>& reference_t,
                                             const std::vector<Eigen::Quaterniond>& reference_q_in_c);

/// Of a drift coefficient, rad/s, or an alignment, component of the rotation vector, rad; nothing where the truth does
/// not give it.
[[nodiscard]] std::optional<double> true_value(const Truth& truth, const ParameterId& parameter);

/// Drift coefficients that the truth does not name.
enum class UnnamedDrift : std::uint8_t { kIsUnknown, kIsZero };

/// The errors of a calibration, in the order of Calibration::states: estimate − truth of drift, rad/s; of alignment,
/// rad, the small rotation vector δ of C_c_b(est) = exp([δ×]) C_c_b(true), c axes. NaN where the truth does not give
/// it.
[[nodiscard]] Eigen::VectorXd estimate_minus_truth(const Calibration& calibration, const Truth& truth,
                                                   UnnamedDrift unnamed = UnnamedDrift::kIsUnknown);

/// eᵀ P⁻¹ e (NEES) of errors e with covariance P, whose units may differ by any powers of ten. NaN where P is not
/// positive definite.
[[nodiscard]] double normalised_square(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance);

/// Errors over a stretch of time.
struct ErrorStatistics {
  Time from{};
  Time to{};
  std::size_t count = 0;
  Eigen::Vector3d rms_rad{0, 0, 0};
  Eigen::Vector3d max_rad{0, 0, 0};
  double max_total_rad = 0;
  /// Mean over the axes of (error/sigma)²: 1 for honest sigmas. Absent where the solution claims none.
  std::optional<double> normalised_square;
};

/// Over the whole.
[[nodiscard]] ErrorStatistics statistics(const AttitudeErrors& errors);
/// Over consecutive stretches of `length` from `start` on. Where a correction is by a fix at the boundary, the next
/// stretch begins with the first epoch after it that has it.
[[nodiscard]] std::vector<ErrorStatistics> statistics_by_stretch(const AttitudeErrors& errors, Time start,
                                                                 Duration length);

/// After each astro-correction: the time until the total error first passes `limit_rad`; absent where it did not before
/// the next.
struct CorrectionInterval {
  Time corrected{};
  Duration observed{};             ///< how long this stretch was watched
  std::optional<Duration> passed;  ///< when the limit was passed
  double max_total_rad = 0;
};
/// Empty where `errors` has no ages.
[[nodiscard]] std::vector<CorrectionInterval> correction_intervals(const AttitudeErrors& errors, double limit_rad);

/// The same astro-correction with the parameters known before a calibration, and with those calibrated.
struct IntervalPair {
  CorrectionInterval known_before;
  CorrectionInterval calibrated;

  /// Interval with calibrated over interval with known parameters; a lower bound where the calibrated one did not pass
  /// the limit while it was watched. Absent where the known one did not, or nothing was watched.
  [[nodiscard]] std::optional<double> extension() const;
};

/// Extension of the correction interval (the paper claims 3–5): the median over corrections.
struct Extension {
  double factor = 0;
  /// A correction that determines the median was still within the limit at the end of the data.
  bool is_lower_bound = false;
};
/// Absent where no pair has one.
[[nodiscard]] std::optional<Extension> median_extension(const std::vector<IntervalPair>& pairs);

/// Pairs of corrections at the same time, within two seconds; others have no partner.
[[nodiscard]] std::vector<IntervalPair> paired(const std::vector<CorrectionInterval>& known_before,
                                               const std::vector<CorrectionInterval>& calibrated);

}  // namespace trihedron::ground
