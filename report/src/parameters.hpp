#pragma once
/// The parameters of a calibration one by one: value, sigma, history, and the truth where it is known.

#include <optional>
#include <string>
#include <vector>

#include "trihedron/report/report.hpp"

namespace trihedron::report {

/// One row of Calibration::states.
struct Parameter {
  std::string state;     ///< "gyro1.k0"
  std::size_t gyro = 0;  ///< from 0
  std::string name;      ///< "k0", "align_x"
  std::string symbol;    ///< "k₀", "Λx"
  bool is_alignment = false;
  double value = 0;        ///< rad/s; alignment: component of the rotation vector, rad
  double sigma = 0;        ///< rad/s or rad
  double first_sigma = 0;  ///< before the data: of the first row of the history
  std::optional<double> truth;
  /// Estimate minus truth; alignment: −δ of C_c_b(true) = exp([δ×]) C_c_b(est).
  std::optional<double> error;
  /// Time of the pass after which the error stays within 3 final sigmas or 10 % of its first value, whichever is
  /// larger; against the truth, or else the final value. Absent where the last row is still outside.
  std::optional<double> converged_min;

  /// "k₀ of gyro 1"
  [[nodiscard]] std::string full_symbol() const { return symbol + " of gyro " + std::to_string(gyro + 1); }
  /// Whether the data say more of it than was known before.
  [[nodiscard]] bool determined() const { return !(sigma > 0.5 * first_sigma); }
};

/// All of them, in the order of Calibration::states.
[[nodiscard]] std::vector<Parameter> parameters_of(const ReportInput& input);

/// For people: "k0" → "k₀", "mu31" → "μ₃₁", "align_x" → "Λx"; other names as they are.
[[nodiscard]] std::string symbol_of(const std::string& name);

/// Row after which `error` stays within `tolerance`; the number of rows where it does not at the end.
[[nodiscard]] std::size_t settled_from(const std::vector<double>& error, double tolerance);

}  // namespace trihedron::report
