#include "batch/members.hpp"

#include <Eigen/Cholesky>
#include <utility>

#include "linear/gram.hpp"
#include "model/prior.hpp"

namespace trihedron::ground {
namespace {

using Eigen::MatrixXd;

/// The part of a symmetric matrix, in units of the covariance L Lᵀ, that makes it larger; L: lower triangle.
MatrixXd positive_part(const MatrixXd& added, const MatrixXd& L) {
  MatrixXd axes = added;
  solve_lower(L, axes);
  axes.transposeInPlace();
  solve_lower(L, axes);
  const Eigen::VectorXd longer_by = to_axes(axes);
  return square(multiply(L, axes) * longer_by.cwiseMax(0).cwiseSqrt().asDiagonal());
}

/// Those of a drift field. What the pass says of its modes is known; the members are the most likely ones that make
/// them, and what the modes leave open of them is as uncertain as before. `more_covariance`: for the uncertainty of the
/// spectrum.
KappaAndDelta with_members(const PassProblem& problem, const MatrixXd& more_covariance, const KappaAndDelta& by_modes) {
  const Layout& modes = problem.layout();
  const Layout members = problem.setup().layout();
  const Prior& prior = problem.setup().prior;
  PerGyro<MatrixXd> amplitudes;
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(modes.parameters());  // from the prior means
  const Eigen::Index size = members.drift_size() - Layout::kEq1;
  for (int k = 0; k < members.gyros; ++k) {
    amplitudes[k] = problem.modes()->gyros[k].amplitudes;
    const Gyro& before = prior.gyros[k];
    const Gyro& after = by_modes.gyros[k];
    const Eigen::VectorXd drift = after.drift_rad_s - before.drift_rad_s;
    const int row = modes.drift(k) - modes.drift(0);
    moved.segment<Layout::kEq1>(row) = drift.head<Layout::kEq1>();
    moved.segment(row + Layout::kEq1, amplitudes[k].rows()) = amplitudes[k] * drift.segment(Layout::kEq1, size);
    moved.segment<3>(row + modes.drift_size()) =
        Rot<C, C>::assume(Eigen::Matrix3d(after.C_c_b * before.C_c_b.transpose())).log().raw();
  }
  // In units of the prior sigmas, which differ by many powers of ten.
  const MatrixXd known = prior.covariance.topLeftCorner(members.parameters(), members.parameters());
  const Eigen::VectorXd sigma = known.diagonal().cwiseSqrt();
  const MatrixXd scaled = sigma.cwiseInverse().asDiagonal() * known * sigma.cwiseInverse().asDiagonal();
  const MatrixXd to_modes = parameters_by_parameters(modes, members, amplitudes);
  const MatrixXd by_parameters = to_modes * sigma.asDiagonal();
  const MatrixXd before = multiply(by_parameters, scaled);
  const MatrixXd follow =
      sigma.asDiagonal() * MatrixXd(multiply(before, by_parameters.transpose()).ldlt().solve(before).transpose());
  KappaAndDelta found{by_modes.gyros, {}, follow, to_modes, {}};
  const Eigen::VectorXd errors = follow * moved;
  for (int k = 0; k < members.gyros; ++k) {
    const int row = members.drift(k) - members.drift(0) + Layout::kEq1;
    found.gyros[k].drift_rad_s.segment(Layout::kEq1, size) =
        prior.gyros[k].drift_rad_s.segment(Layout::kEq1, size) + errors.segment(row, size);
  }
  // What the modes leave open: of members alone, since modes, coefficients of eq. (1) and alignments are among them.
  found.covariance = known - multiply(follow, before) * sigma.asDiagonal();
  for (int k = 0; k < members.gyros; ++k) {
    const int row = members.drift(k) - members.drift(0);
    for (const auto& [first, count] : {std::pair(row, Layout::kEq1), std::pair(row + members.drift_size(), 3)}) {
      found.covariance.middleRows(first, count).setZero();
      found.covariance.middleCols(first, count).setZero();
    }
  }
  found.covariance += multiply(multiply(follow, by_modes.covariance), follow.transpose());
  found.covariance = (found.covariance + found.covariance.transpose()).eval() / 2;
  if (more_covariance.size() > 0) {
    MatrixXd root = found.covariance;
    static_cast<void>(to_root(root));  // positive definite, since the pass has a solution
    root.triangularView<Eigen::StrictlyUpper>().setZero();
    found.added = positive_part(more_covariance, root);
    found.covariance += found.added;
  }
  return found;
}

}  // namespace

KappaAndDelta kappa_and_delta(const PassProblem& problem, const BatchResult& result, const MatrixXd& more_covariance) {
  const Layout& layout = problem.layout();
  const int size = layout.parameters();
  KappaAndDelta found{result.solution.gyros,
                      square(MatrixXd(result.errors.last_root.middleRows(layout.drift(0), size))),
                      MatrixXd::Identity(size, size),
                      MatrixXd::Identity(size, size),
                      {}};
  return problem.modes() ? with_members(problem, more_covariance, found) : found;
}

Calibration calibration_of(const PassProblem& problem, const KappaAndDelta& parameters) {
  const Layout& layout = problem.setup().on_board.layout;
  Calibration calibration;
  for (int k = 0; k < layout.gyros; ++k) {
    calibration.gyros.push_back(record_of(parameters.gyros[k], k, problem.setup().on_board, 0));
  }
  calibration.states = drift_and_alignment(layout.drift_model, static_cast<std::size_t>(layout.gyros));
  calibration.covariance = parameters.covariance;
  return calibration;
}

}  // namespace trihedron::ground
