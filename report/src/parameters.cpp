#include "parameters.hpp"

#include <cmath>
#include <string_view>
#include <utility>

#include "trihedron/ground/evaluate/convergence.hpp"
#include "trihedron/ground/evaluate/evaluate.hpp"
#include "units.hpp"

namespace trihedron::report {
namespace {

/// With the subscripts U+2080 … U+2089.
std::string with_subscript(const char* letter, std::string_view digits) {
  std::string symbol = letter;
  for (const char digit : digits) {
    symbol += "\xE2\x82";
    symbol += static_cast<char>(0x80 + (digit - '0'));
  }
  return symbol;
}

}  // namespace

std::string symbol_of(const ParameterId& parameter) {
  const std::string name = short_name_of(parameter);
  if (parameter.is_alignment()) {
    return std::string("Λ") + name.back();
  }
  if (!parameter.is_drift() || !parameter.coefficient.is_in_eq1()) {
    return name;
  }
  const std::string_view digits = std::string_view(name).substr(name.find_first_of("0123456789"));
  return with_subscript(name.starts_with("mu") ? "μ" : name.starts_with("nu") ? "ν" : "k", digits);
}

std::vector<Parameter> parameters_of(const ReportInput& input) {
  const Calibration& calibration = input.run.calibration;
  const auto convergence = ground::convergence(input.run, input.truth);
  const Eigen::VectorXd errors =
      input.truth == nullptr ? Eigen::VectorXd() : ground::estimate_minus_truth(calibration, *input.truth);
  std::vector<Parameter> parameters;
  for (std::size_t i = 0; i < calibration.states.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    Parameter parameter;
    parameter.id = calibration.states[i];
    parameter.row = i;
    // Of a drift field the report shows the levels: its hundreds of members mean little one by one.
    if (!calibration.drift_field.empty() && parameter.id.is_drift() && !parameter.id.coefficient.is_in_eq1()) {
      continue;
    }
    parameter.symbol = symbol_of(parameter.id);
    parameter.value = value_of(calibration, parameter.id);
    parameter.sigma = std::sqrt(calibration.covariance(row, row));
    parameter.first_sigma = std::sqrt(input.run.known_before.covariance(row, row));
    parameter.is_determined = convergence[i].determined;
    parameter.is_followed = convergence[i].followed;
    if (convergence[i].settled) {
      parameter.converged_min = to_minutes(*convergence[i].settled);
    }
    if (input.truth != nullptr) {
      parameter.truth = ground::true_value(*input.truth, parameter.id);
    }
    if (parameter.truth) {
      parameter.error = errors(row);
    }
    parameters.push_back(std::move(parameter));
  }
  return parameters;
}

}  // namespace trihedron::report
