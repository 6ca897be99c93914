#pragma once
/// The parameters of a calibration one by one: value, sigma, history, and the truth where it is known.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "trihedron/report/report.hpp"

namespace trihedron::report {

/// One row of Calibration::states.
struct Parameter {
  ParameterId id;
  std::size_t row = 0;        ///< in Calibration::states and its covariance, and in ParameterHistory
  std::string symbol;         ///< "k₀", "Λx"
  double value = 0;           ///< rad/s; alignment: component of the rotation vector, rad
  double sigma = 0;           ///< rad/s or rad
  double first_sigma = 0;     ///< of the prior
  bool is_determined = true;  ///< the data say more of it than was known before
  bool is_followed = true;    ///< the on-board step, whose course is shown, estimates it
  std::optional<double> truth;
  std::optional<double> error;          ///< estimate − truth, as ground::estimate_minus_truth()
  std::optional<double> converged_min;  ///< as ground::Convergence::settled

  /// "k₀ of gyro 1"
  [[nodiscard]] std::string full_symbol() const { return symbol + " of gyro " + std::to_string(id.gyro() + 1); }
};

/// All of them, in the order of Calibration::states; of a drift field those of eq. (1) and the alignments.
[[nodiscard]] std::vector<Parameter> parameters_of(const ReportInput& input);

/// "k₀", "μ₃₁", "Λx", "W(1,-1)": without the gyro.
[[nodiscard]] std::string symbol_of(const ParameterId& parameter);

}  // namespace trihedron::report
