#pragma once
/// Numbers that sum up how a calibration or navigation went.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trihedron {

/// Numbers that judge a calibration.
struct Statistics {
  long fixes = 0;  ///< in the telemetry
  long fixes_used = 0;
  long fixes_rejected_as_outliers = 0;
  /// Rejected fixes in a row that are no outliers any more: star tracker or gyros are wrong there.
  static constexpr long kInARow = 20;
  /// In runs of so many and more whose misfits are larger than drift can cause.
  long fixes_off_in_a_row = 0;
  /// Refused because the star tracker repeated its quaternion while the body turned.
  long fixes_frozen = 0;
  long reopened = 0;                       ///< how often the filter reopened the directions, or restarted
  long nis_count = 0;                      ///< fixes that the mean NIS is over
  double nis_degrees_of_freedom = 0;       ///< their mean
  std::optional<double> nis_mean;          ///< where there are any
  std::vector<double> innovation_rms_rad;  ///< by component, two per gyro, where there are any
  /// How often the angles between the momenta were used in place of a fix.
  std::optional<long> angle_looks;

  // Of estimator batch.
  std::optional<int> batch_iterations;
  std::optional<bool> batch_converged;
  /// Of the constants by the first half of the pass against those by all of it.
  std::optional<double> halves_chi_square;
  std::optional<int> halves_degrees_of_freedom;
};

/// Those that have a value, as calibration.json has them: in the order of their names.
[[nodiscard]] std::vector<std::pair<std::string, double>> named_values(const Statistics& statistics);

/// Sets one by its name in calibration.json; does nothing for a name that this program does not know. A value that is
/// no number leaves a count as it is.
void set_value(Statistics& statistics, std::string_view name, double value);

}  // namespace trihedron
