#include "batch/pass_setup.hpp"

#include <algorithm>
#include <vector>

#include "model/prior.hpp"
#include "model/setup.hpp"
#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/parameter_id.hpp"

namespace trihedron::ground {

PassSetup pass_setup(const PassSettings& settings, const CalibrationOptions& options) {
  PassSetup setup;
  setup.on_board = setup_of(settings, options);
  setup.prior = prior_of(settings, setup.on_board.layout);
  return setup;
}

PassSolution first_solution(const PassProblem& problem, const Screened& screened) {
  Gyros gyros;
  for (std::size_t k = 0; k < screened.first.size(); ++k) {
    gyros[static_cast<int>(k)] = gyro_of(screened.first[k], problem.setup().on_board.layout);
  }
  return problem.start(gyros);
}

PassSolution first_solution(const PassProblem& problem, const Nearby& nearby) {
  const Layout& from = nearby.layout;
  const Layout& to = problem.setup().on_board.layout;
  const std::vector<DriftCoefficient> its = coefficients_of(from.drift_model);
  const std::vector<DriftCoefficient> wanted = coefficients_of(to.drift_model);
  const PassSolution& found = nearby.solution;
  Gyros gyros;
  for (int k = 0; k < to.gyros; ++k) {
    const Gyro& gyro = found.gyros[k];
    gyros[k].C_c_b = gyro.C_c_b;
    gyros[k].drift_rad_s.setZero(to.drift_columns());
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (const auto same = std::ranges::find(its, wanted[i]); same != its.end()) {
        gyros[k].drift_rad_s(static_cast<Eigen::Index>(i)) = gyro.drift_rad_s(same - its.begin());
      }
    }
    const auto here = to.beside_kappa(k);
    const auto there = from.beside_kappa(k);
    for (std::size_t i = 0; i < here.size(); ++i) {
      const int size = std::min(here[i].size, there[i].size);
      gyros[k].drift_rad_s.segment(here[i].column, size) = gyro.drift_rad_s.segment(there[i].column, size);
    }
    if (to.further.readout_bias) {
      gyros[k].readout_bias = gyro.readout_bias;
    }
  }
  PassSolution first;
  if (found.arcs.size() == problem.arcs()) {
    first.gyros = gyros;
    first.shared.setZero(to.shared_size());
    first.arcs = found.arcs;
    for (PassSolution::Arc& arc : first.arcs) {
      for (Eigen::Vector3d& wandering_rad_s : arc.wandering_rad_s) {
        wandering_rad_s *= from.further.wandering_drift && to.further.wandering_drift ? 1 : 0;
      }
    }
  } else {
    first = problem.start(gyros);
  }
  for (const ParameterId& parameter : further_parameters(to)) {
    if (const int state = state_of(to, parameter); state >= to.shared() && from.has(parameter.further_state)) {
      first.shared(state - to.shared()) = value_of(from, found.gyros, found.shared, parameter);
    }
  }
  return first;
}

}  // namespace trihedron::ground
