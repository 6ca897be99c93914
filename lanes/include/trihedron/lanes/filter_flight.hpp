#pragma once
/// Flights of which only the calibration filter is of interest: simulated, filtered and compared with the truth, eight
/// at once where they are alike.

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "trihedron/core/drift_model.hpp"
#include "trihedron/records/options.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::lanes {

/// What is flown. Of the options what is "auto" becomes what is taken before a pass has been seen: eq. (1), noise as
/// told, no further states.
struct FilterFlight {
  Scenario scenario;
  CalibrationOptions options;
};

/// What became of it.
struct FilterResult {
  DriftModelId drift_model = kEsg7;
  /// Of the coefficients of eq. (1) and then the alignment of each gyro in turn, rad/s and rad: estimate − truth, the
  /// alignments as small rotations about c axes.
  Eigen::VectorXd error;
  Eigen::MatrixXd covariance;
  std::size_t fixes_used = 0;  ///< without the first
  double nis_sum = 0;          ///< over these
  std::size_t fixes_judged = 0;
  double nis_sum_of_judged = 0;  ///< those as well that were rejected or that made the filter begin anew
  std::size_t reopened = 0;      ///< how often it did
  /// Of the attitude at each fix, by the filter and the readings around it: error about c axes, rad; mean of
  /// (error/sigma)².
  Eigen::Vector3d attitude_rms_rad{0, 0, 0};
  double attitude_normalised_square = 0;
};

/// Why a flight failed.
struct FilterFailure {
  std::string reason;
};
using FilterOutcome = std::variant<FilterResult, FilterFailure>;

/// The same by the on-board step, from a whole simulated pass. Throws std::invalid_argument and ground::SetupError.
[[nodiscard]] FilterResult fly_alone(const FilterFlight& flight);

/// Whether flights of this kind go side by side (docs/campaign.md, "The filter alone"), by scenario and options. One
/// that does may still meet what the lanes do not have. Throws as fly_alone().
[[nodiscard]] bool goes_in_lanes(const FilterFlight& flight);

/// Flights that fill the lanes of one thread.
inline constexpr std::size_t kTogether = 8;

/// One outcome for each, in their order. Those that go side by side do, and their results are the same whatever goes
/// beside them; to rounding, 1e-6 of a sigma, they are those of fly_alone(), by which all others are flown: also
/// those on the way of which something happens that a filter meets seldom, as that it begins anew.
[[nodiscard]] std::vector<FilterOutcome> fly(std::span<const FilterFlight> flights);

}  // namespace trihedron::lanes
