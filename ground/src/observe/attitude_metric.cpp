#include "observe/attitude_metric.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;

/// Gauss points of equal weight for angles that are uniformly distributed within the limits: exact to the third power.
std::array<Matrix3d, 4> slews(const Mission& mission) {
  const double roll = mission.max_roll_rad * std::numbers::inv_sqrt3;
  const double pitch = mission.max_pitch_rad * std::numbers::inv_sqrt3;
  const auto slew = [](double roll_rad, double pitch_rad) {
    return (Rot<C, C>::exp(Vec<C>::assume(0, pitch_rad, 0)) * Rot<C, C>::exp(Vec<C>::assume(roll_rad, 0, 0))).raw();
  };
  return {slew(roll, pitch), slew(roll, -pitch), slew(-roll, pitch), slew(-roll, -pitch)};
}

/// Readings after the body has turned from c to c', C_c_c'.
Directions read_after(const Matrix3d& slew, const Gyros& gyros, int count, const Directions& h_b) {
  Directions turned = h_b;
  for (int k = 0; k < count; ++k) {
    turned[k] = gyros[k].reading_of(slew.transpose() * gyros[k].in_c(h_b[k]));
  }
  return turned;
}

}  // namespace

MatrixXd attitude_metric(const PassProblem& problem, const PassSolution& solution, const PassProblem::Linear& linear,
                         const Mission& mission) {
  const Layout& layout = problem.layout();
  const Eigen::Index directions = 2L * layout.gyros;
  const std::array<Matrix3d, 4> turns = slews(mission);
  MatrixXd sum = MatrixXd::Zero(layout.constants(), layout.constants());
  double terms = 0;
  // How the states of the present arc depend on the constants since the correction.
  MatrixXd by_constants = MatrixXd::Zero(layout.dynamic(), layout.constants());
  bool started = false;
  Time corrected{};
  std::size_t arc = 0;
  std::optional<std::size_t> looked_at;  // once per arc is enough
  problem.go_along(solution, [&](const PassProblem::Moment& moment) {
    for (; arc < moment.arc; ++arc) {
      by_constants = (linear.ends[arc].A * by_constants + linear.stages[arc].B).eval();
    }
    if (moment.fix == nullptr || looked_at == arc || count(moment.fix->used) < layout.gyros) {
      return;
    }
    if (!started || moment.t - corrected >= mission.correction_interval) {
      // At a correction the momenta are set such that the residual of the fix is zero.
      const MatrixXd H = problem.compare(solution, moment).H;
      if (H.rows() < directions) {
        return;
      }
      by_constants.setZero();
      by_constants.topRows(directions) = -H.leftCols(directions).partialPivLu().solve(H.rightCols(layout.constants()));
      corrected = moment.t;
      started = true;
    }
    looked_at = arc;
    for (const Matrix3d& turn : turns) {
      const Directions h_b = read_after(turn, moment.gyros, layout.gyros, moment.fix->h_b);
      if (const auto attitude = problem.attitude(moment, h_b, moment.fix->used)) {
        const MatrixXd by_states = problem.attitude_by_states(moment, attitude.value(), h_b);
        const MatrixXd error =
            by_states.leftCols(layout.dynamic()) * by_constants + by_states.rightCols(layout.constants());
        sum.noalias() += error.transpose() * error;
        terms += 3;
      }
    }
  });
  return terms > 0 ? MatrixXd(sum / terms) : sum;
}

}  // namespace trihedron::ground
