#include "parameters.hpp"

#include <algorithm>
#include <cmath>

#include "trihedron/core/frames.hpp"
#include "units.hpp"

namespace trihedron::report {
namespace {

constexpr std::string_view kAlignmentPrefix = "align_";

const double* find(const std::vector<std::pair<std::string, double>>& table, const std::string& name) {
  const auto found = std::find_if(table.begin(), table.end(), [&](const auto& entry) { return entry.first == name; });
  return found == table.end() ? nullptr : &found->second;
}

Eigen::Vector3d alignment_error(const Eigen::Vector3d& estimate_rad, const Eigen::Vector3d& truth_rad) {
  const auto C_c_b = [](const Eigen::Vector3d& v) { return Rot<C, B<1>>::exp(Vec<C>::assume(v)); };
  return (C_c_b(estimate_rad) * C_c_b(truth_rad).inverse()).log().raw();
}

void set_value_and_truth(const ReportInput& input, Parameter& parameter) {
  const GyroCalibration& gyro = input.run.calibration.gyros[parameter.gyro];
  const bool has_truth = input.truth != nullptr && parameter.gyro < input.truth->gyros.size();
  if (parameter.is_alignment) {
    const Eigen::Index axis = parameter.name.back() - 'x';
    parameter.value = gyro.alignment_rotation_vector_rad(axis);
    if (has_truth) {
      const Eigen::Vector3d& truth_rad = input.truth->gyros[parameter.gyro].alignment_rotation_vector_rad;
      parameter.truth = truth_rad(axis);
      parameter.error = alignment_error(gyro.alignment_rotation_vector_rad, truth_rad)(axis);
    }
    return;
  }
  const double* value = find(gyro.drift_rad_s, parameter.name);
  parameter.value = value == nullptr ? std::nan("") : *value;
  const double* truth = has_truth ? find(input.truth->gyros[parameter.gyro].drift_rad_s, parameter.name) : nullptr;
  if (truth != nullptr) {
    parameter.truth = *truth;
    parameter.error = parameter.value - *truth;
  }
}

void set_history(const ReportInput& input, std::size_t column, Parameter& parameter) {
  const ground::ParameterHistory& history = input.run.parameters;
  parameter.first_sigma = parameter.sigma;
  if (history.t.empty()) {
    return;
  }
  parameter.first_sigma = history.sigma.front()[column];
  const double final_value = parameter.truth.value_or(parameter.value);
  std::vector<double> error;
  error.reserve(history.t.size());
  for (const std::vector<double>& row : history.value) {
    error.push_back(row[column] - final_value);
  }
  const double tolerance = std::max(3 * parameter.sigma, 0.1 * std::abs(error.front()));
  if (const std::size_t row = settled_from(error, tolerance); row < error.size()) {
    parameter.converged_min = to_minutes(history.t[row] - input.run.calibration.epoch);
  }
}

}  // namespace

std::size_t settled_from(const std::vector<double>& error, double tolerance) {
  std::size_t row = error.size();
  while (row > 0 && std::abs(error[row - 1]) <= tolerance) {
    --row;
  }
  return row;
}

std::string symbol_of(const std::string& name) {
  if (name.starts_with(kAlignmentPrefix)) {
    return "Λ" + name.substr(kAlignmentPrefix.size());
  }
  const std::size_t digits = std::min(name.find_first_of("0123456789"), name.size());
  const std::string letters = name.substr(0, digits);
  std::string symbol = letters == "mu" ? "μ" : letters == "nu" ? "ν" : letters == "k" ? "k" : "";
  if (symbol.empty() || name.find_first_not_of("0123456789", digits) != std::string::npos) {
    return name;
  }
  for (const char digit : name.substr(digits)) {
    symbol += "\xE2\x82";  // the subscripts U+2080 … U+2089
    symbol += static_cast<char>(0x80 + (digit - '0'));
  }
  return symbol;
}

std::vector<Parameter> parameters_of(const ReportInput& input) {
  const Calibration& calibration = input.run.calibration;
  std::vector<Parameter> parameters;
  for (std::size_t i = 0; i < calibration.states.size(); ++i) {
    const std::string& state = calibration.states[i];
    const std::size_t dot = state.find('.');
    Parameter parameter;
    parameter.state = state;
    parameter.gyro = std::stoul(state.substr(std::string_view("gyro").size())) - 1;
    parameter.name = state.substr(dot + 1);
    parameter.symbol = symbol_of(parameter.name);
    parameter.is_alignment = parameter.name.starts_with(kAlignmentPrefix);
    const auto row = static_cast<Eigen::Index>(i);
    parameter.sigma = std::sqrt(calibration.covariance(row, row));
    set_value_and_truth(input, parameter);
    set_history(input, i, parameter);
    parameters.push_back(std::move(parameter));
  }
  return parameters;
}

}  // namespace trihedron::report
