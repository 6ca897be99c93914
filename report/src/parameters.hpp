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
  double value = 0;           ///< rad/s; alignment: component of the rotation vector, rad
  double sigma = 0;           ///< rad/s or rad
  double first_sigma = 0;     ///< before the data
  bool is_determined = true;  ///< the data say more of it than was known before
  bool is_followed = true;    ///< the on-board cycle, whose course is shown, estimates it
  std::optional<double> truth;
  /// Estimate minus truth; alignment: −δ of C_c_b(true) = exp([δ×]) C_c_b(est).
  std::optional<double> error;
  std::optional<double> converged_min;  ///< as ground::Convergence::settled

  /// "k₀ of gyro 1"
  [[nodiscard]] std::string full_symbol() const { return symbol + " of gyro " + std::to_string(gyro + 1); }
};

/// All of them, in the order of Calibration::states.
[[nodiscard]] std::vector<Parameter> parameters_of(const ReportInput& input);

/// For people: "k0" → "k₀", "mu31" → "μ₃₁", "align_x" → "Λx"; other names as they are.
[[nodiscard]] std::string symbol_of(const std::string& name);

}  // namespace trihedron::report
