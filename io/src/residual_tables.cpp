#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "trihedron/io/residuals.hpp"

namespace trihedron::io {

namespace {

Table fix_table(const CalibrationRun& run) {
  Table fixes{"fixes", {}, {}};
  const std::size_t components = 2 * run.calibration.gyros.size();
  const char* innovation =
      run.calibration.estimator == Estimator::kBatch
          ? "what the smoothed pass leaves of a fix that it compares, gyro and component across its momentum"
          : "innovation of eq. (3), gyro and component in qi";
  for (std::size_t i = 0; i < components; ++i) {
    // The paper numbers its quasi-inertial axes so.
    const std::string component = fmt::format("gyro{}_{}", i / 2 + 1, components == 4 && i == 1 ? 3 : i % 2 + 1);
    fixes.columns.push_back(
        {fmt::format("innovation_{}", component), "rad", fmt::format("{}: {}", innovation, component), {}});
    fixes.columns.push_back({fmt::format("innovation_{}_sigma", component), "rad", "its 1-sigma", {}});
  }
  fixes.columns.push_back(
      {"nis", "1", fmt::format("normalised innovation squared, {} degrees of freedom", components), {}});
  fixes.columns.push_back({"used", "1", "1 used, 0 rejected", {}});
  for (const FixRecord& fix : run.fixes) {
    fixes.t.push_back(fix.t);
    for (std::size_t i = 0; i < fix.innovation.size(); ++i) {
      fixes.columns[2 * i].values.push_back(fix.innovation[i]);
      fixes.columns[2 * i + 1].values.push_back(fix.innovation_sigma[i]);
    }
    fixes.columns[2 * components].values.push_back(fix.nis);
    fixes.columns[2 * components + 1].values.push_back(fix.used() ? 1 : 0);
  }
  return fixes;
}

Table parameter_table(const CalibrationRun& run) {
  Table parameters{"parameters", run.parameters.t, {}};
  for (std::size_t i = 0; i < run.calibration.states.size(); ++i) {
    const ParameterId& state = run.calibration.states[i];
    if (!run.calibration.drift_field.empty() && state.is_drift() && !state.coefficient.is_in_eq1()) {
      continue;  // one of the hundreds of members of a drift field
    }
    std::string name = name_of(state);
    std::ranges::replace(name, '.', '_');
    const char* unit = state.is_alignment() ? "rad" : "rad s-1";
    std::vector<double> value;
    std::vector<double> sigma;
    for (std::size_t row = 0; row < run.parameters.t.size(); ++row) {
      value.push_back(run.parameters.value[row][i]);
      sigma.push_back(run.parameters.sigma[row][i]);
    }
    if (!value.empty() && std::ranges::all_of(value, [](double its) { return std::isnan(its); })) {
      continue;  // found from the whole pass, and not followed along it
    }
    parameters.columns.push_back({name, unit, "estimate of " + name_of(state) + " after the fix", std::move(value)});
    parameters.columns.push_back({name + "_sigma", unit, "its 1-sigma", std::move(sigma)});
  }
  return parameters;
}

Table angle_table(const CalibrationRun& run) {
  Table angle{"angle", run.angle_t, {}};
  angle.columns.push_back({"residual_min", "1", "z1 of eq. (3), least of 3 s", run.angle_residual_min});
  angle.columns.push_back({"residual_max", "1", "z1 of eq. (3), greatest of 3 s", run.angle_residual_max});
  return angle;
}

}  // namespace

std::vector<Table> residual_tables(const CalibrationRun& run) {
  return {fix_table(run), parameter_table(run), angle_table(run)};
}

}  // namespace trihedron::io
