#include "parameters.hpp"

#include <algorithm>
#include <cmath>

#include "trihedron/core/frames.hpp"
#include "trihedron/ground/evaluate/convergence.hpp"
#include "units.hpp"

namespace trihedron::report {
namespace {

const double* find(const std::vector<std::pair<std::string, double>>& table, const std::string& name) {
  const auto found = std::ranges::find_if(table, [&](const auto& entry) { return entry.first == name; });
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
  parameter.truth = has_truth ? input.truth->gyros[parameter.gyro].drift(parameter.name) : std::nullopt;
  if (parameter.truth) {
    parameter.error = parameter.value - *parameter.truth;
  }
}

}  // namespace

std::string symbol_of(const std::string& name) {
  if (constexpr std::string_view kAlignment = "align_"; name.starts_with(kAlignment)) {
    return "Λ" + name.substr(kAlignment.size());
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
  const auto convergence = ground::convergence(input.run, input.truth);
  std::vector<Parameter> parameters;
  for (std::size_t i = 0; i < calibration.states.size(); ++i) {
    const StateName name(calibration.states[i]);
    Parameter parameter;
    parameter.state = calibration.states[i];
    parameter.gyro = name.gyro;
    parameter.name = name.parameter;
    parameter.symbol = symbol_of(parameter.name);
    parameter.is_alignment = name.is_alignment;
    const auto row = static_cast<Eigen::Index>(i);
    parameter.sigma = std::sqrt(calibration.covariance(row, row));
    parameter.first_sigma = std::sqrt(input.run.known_before.covariance(row, row));
    parameter.is_determined = convergence[i].determined;
    parameter.is_followed = convergence[i].followed;
    if (convergence[i].settled) {
      parameter.converged_min = to_minutes(*convergence[i].settled);
    }
    set_value_and_truth(input, parameter);
    parameters.push_back(std::move(parameter));
  }
  return parameters;
}

}  // namespace trihedron::report
