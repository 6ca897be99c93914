#pragma once
/// When the parameters settled.

#include <optional>
#include <vector>

#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Row after which `error` stays within `tolerance`; the number of rows where it does not at the end.
[[nodiscard]] std::size_t settled_from(const std::vector<double>& error, double tolerance);

/// Whether the data say more of the parameter in this row of Calibration::states than was known before.
[[nodiscard]] bool is_determined(const CalibrationRun& run, std::size_t row);
/// Of the drift coefficients of eq. (1).
[[nodiscard]] Determined determined(const CalibrationRun& run);

/// When one parameter converged.
struct Convergence {
  bool determined = false;  ///< otherwise there is nothing to settle to
  bool followed = true;     ///< false where the on-board step, whose course this is, does not estimate it
  /// Since the pass epoch: after it the error stays within 3 final sigmas or 10 % of its first value, whichever is
  /// larger. Absent where it is outside at the end.
  std::optional<Duration> settled;
};

/// One per row of Calibration::states; error against `truth`, or else against the final value.
[[nodiscard]] std::vector<Convergence> convergence(const CalibrationRun& run, const Truth* truth);

/// Of the determined and followed alignments, or else drift coefficients of eq. (1): when the last one settled. Absent
/// where one has not, or there is none.
[[nodiscard]] std::optional<Duration> settled(const CalibrationRun& run, const std::vector<Convergence>& parameters,
                                              bool alignments);

}  // namespace trihedron::ground
