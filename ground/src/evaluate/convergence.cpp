#include "trihedron/ground/evaluate/convergence.hpp"

#include <algorithm>
#include <cmath>

#include "trihedron/ground/evaluate/evaluate.hpp"

namespace trihedron::ground {
namespace {

double sigma_in_row(const Calibration& calibration, std::size_t row) {
  const auto i = static_cast<Eigen::Index>(row);
  return std::sqrt(calibration.covariance(i, i));
}

}  // namespace

bool is_determined(const CalibrationRun& run, std::size_t row) {
  return sigma_in_row(run.calibration, row) <= 0.5 * sigma_in_row(run.known_before, row);
}

Determined determined(const CalibrationRun& run) {
  Determined found;
  for (std::size_t row = 0; row < run.calibration.states.size(); ++row) {
    const ParameterId& state = run.calibration.states[row];
    if (state.is_drift() && state.coefficient.is_in_eq1()) {
      ++found.of;
      found.coefficients += is_determined(run, row) ? 1 : 0;
    }
  }
  return found;
}

std::size_t settled_from(const std::vector<double>& error, double tolerance) {
  std::size_t row = error.size();
  while (row > 0 && std::abs(error[row - 1]) <= tolerance) {
    --row;
  }
  return row;
}

std::vector<Convergence> convergence(const CalibrationRun& run, const Truth* truth) {
  const Calibration& calibration = run.calibration;
  const ParameterHistory& history = run.parameters;
  std::vector<Convergence> result(calibration.states.size());
  for (std::size_t i = 0; i < result.size() && !history.t.empty(); ++i) {
    const std::optional<double> reference = truth == nullptr ? std::nullopt : true_value(*truth, calibration.states[i]);
    std::vector<double> error;
    error.reserve(history.t.size());
    for (const std::vector<double>& row : history.value) {
      error.push_back(row[i] - reference.value_or(history.value.back()[i]));
    }
    result[i].determined = is_determined(run, i);
    result[i].followed = std::isfinite(history.value.back()[i]);
    const double tolerance = std::max(3 * sigma_in_row(run.calibration, i), 0.1 * std::abs(error.front()));
    const std::size_t from = settled_from(error, tolerance);
    if (from < error.size()) {
      result[i].settled = history.t[from] - calibration.epoch;
    }
  }
  return result;
}

std::optional<Duration> settled(const CalibrationRun& run, const std::vector<Convergence>& parameters,
                                bool alignments) {
  std::optional<Duration> last;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const ParameterId& state = run.calibration.states[i];
    const bool is_wanted = alignments ? state.is_alignment() : state.is_drift() && state.coefficient.is_in_eq1();
    if (!is_wanted || !parameters[i].determined || !parameters[i].followed) {
      continue;
    }
    if (!parameters[i].settled) {
      return std::nullopt;
    }
    last = std::max(last.value_or(Duration::zero()), *parameters[i].settled);
  }
  return last;
}

}  // namespace trihedron::ground
