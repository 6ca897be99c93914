#include "batch/pass_setup.hpp"

#include "model/prior.hpp"
#include "model/setup.hpp"

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

}  // namespace trihedron::ground
