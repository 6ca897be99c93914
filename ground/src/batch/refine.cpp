#include "batch/refine.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "batch/members.hpp"
#include "batch/pass_setup.hpp"
#include "batch/smoothed_attitude.hpp"
#include "linear/gram.hpp"
#include "model/open_loop_start.hpp"
#include "model/prior.hpp"
#include "model/setup.hpp"
#include "trihedron/ground/model/setup_error.hpp"

namespace trihedron::ground {
namespace {

using Eigen::MatrixXd;

/// Replaces the innovation of each fix by its residual after smoothing.
void use_residuals(const PassProblem& problem, const PassSolution& solution, const CovarianceRoots& roots,
                   std::vector<FixRecord>& fixes) {
  std::map<std::pair<Time, int>, FixRecord*> compared;
  for (FixRecord& fix : fixes) {
    if (fix.used() || fix.status == FixStatus::kRejectedByGate) {
      compared[{fix.t, fix.head}] = &fix;
    }
  }
  // Those of an arc together, because their spread is one large product.
  struct Residual {
    FixRecord* fix = nullptr;
    GyroMask used{};
    PassProblem::FixRows rows;
  };
  std::vector<Residual> of_arc;
  std::size_t arc = 0;
  const auto put_into_fixes = [&] {
    Eigen::Index size = 0;
    for (const Residual& residual : of_arc) {
      size += residual.rows.y.size();
    }
    MatrixXd all(size, problem.layout().size());
    Eigen::Index row = 0;
    for (const Residual& residual : of_arc) {
      all.middleRows(row, residual.rows.y.size()) = residual.rows.H;
      row += residual.rows.y.size();
    }
    const MatrixXd spreads = roots.spread(arc, all);
    row = 0;
    for (const Residual& residual : of_arc) {
      const PassProblem::FixRows& rows = residual.rows;
      FixRecord& fix = *residual.fix;
      MatrixXd covariance = rows.R;
      fix.status = FixStatus::kRejectedByGate;
      if (!problem.is_outlier(rows)) {
        fix.status = FixStatus::kUsed;
        const auto spread = spreads.middleRows(row, rows.y.size());
        covariance -= spread * spread.transpose();
      }
      if (rows.R_alone != rows.R) {  // what is left of the noise of the fix alone: the same part of it
        const MatrixXd root = rows.R.llt().matrixL();
        const MatrixXd root_alone = rows.R_alone.llt().matrixL();
        const MatrixXd to_alone = root.triangularView<Eigen::Lower>().solve<Eigen::OnTheRight>(root_alone);
        covariance = to_alone * covariance * to_alone.transpose();
      }
      row += rows.y.size();
      fix.nis = rows.y.dot(covariance.ldlt().solve(rows.y));
      fix.degrees_of_freedom = static_cast<int>(rows.y.size());
      std::ranges::fill(fix.innovation, 0);
      std::ranges::fill(fix.innovation_sigma, 0);
      Eigen::Index component = 0;
      for (int k = 0; k < problem.layout().gyros; ++k) {
        for (int i = 2 * k; residual.used[k] && i < 2 * k + 2; ++i, ++component) {
          fix.innovation[static_cast<std::size_t>(i)] = rows.y(component);
          fix.innovation_sigma[static_cast<std::size_t>(i)] = std::sqrt(covariance(component, component));
        }
      }
    }
    of_arc.clear();
  };
  problem.go_along(solution, [&](const PassProblem::Moment& moment) {
    const auto found = moment.fix == nullptr ? compared.end() : compared.find({moment.t, moment.fix->fix.head});
    if (found == compared.end()) {
      return;
    }
    PassProblem::FixRows rows = problem.compare(solution, moment);
    if (rows.y.size() == 0) {
      return;
    }
    if (moment.arc != arc) {
      put_into_fixes();
      arc = moment.arc;
    }
    of_arc.push_back({found->second, moment.fix->used, std::move(rows)});
  });
  put_into_fixes();
}

/// Compares the constants by the first half of the pass with those by all of it (docs/mathematics.md, section 12). Only
/// directions in which the second half at least halves the variance count.
std::optional<Halves> compare_halves(const PassProblem& problem, const BatchResult& result) {
  constexpr double kLeast = 0.5;
  const Layout& layout = problem.layout();
  const PassProblem::Linear& linear = result.linear;
  const std::size_t half = problem.end_of(PassProblem::kParts / 2);
  if (half == 0) {
    return std::nullopt;
  }
  Halves halves;
  const Eigen::Index c = layout.constants();
  const MatrixXd triangle = triangles_after(linear.prior, linear.prior_y, linear.stages, {half - 1}).front();
  const auto R = triangle.block(layout.dynamic(), layout.dynamic(), c, c).triangularView<Eigen::Upper>();
  // In units of the sigmas after the first half; in these the covariance by the whole pass is `rest`.
  const Eigen::VectorXd first = triangle.block(layout.dynamic(), layout.size(), c, 1);
  const MatrixXd known = multiply(MatrixXd(R), result.errors.last_root.bottomRows(c));
  const Eigen::VectorXd whole = R * Eigen::VectorXd(result.errors.x.back().tail(c));
  MatrixXd axes = square(known);
  const Eigen::VectorXd rest = to_axes(axes);
  for (Eigen::Index i = 0; i < c; ++i) {
    const double gained = 1 - rest(i);
    if (gained > kLeast) {
      const double off = axes.col(i).dot(first - whole);
      halves.chi_square += off * off / gained;
      ++halves.degrees_of_freedom;
    }
  }
  return halves;
}

/// The roots of a result, of which only the solution and the covariance at its end are kept: the rest is long.
CovarianceRoots roots_of(BatchResult& result) {
  for (SmootherStage& stage : result.linear.stages) {
    stage.H = {};
  }
  CovarianceRoots roots(result.errors, result.linear.stages);
  result.linear = {};
  result.errors.steps = {};
  return roots;
}

/// Rearranges the columns from the states `from` to the states `to`. A state that was not estimated along the pass gets
/// NaN with its prior sigma.
void rearrange(const std::vector<ParameterId>& from, const std::vector<ParameterId>& to, const PassSetup& setup,
               ParameterHistory& history) {
  const Eigen::VectorXd prior_sigma = setup.prior.covariance.diagonal().cwiseSqrt();
  ParameterHistory rearranged{history.t, {}, {}};
  for (std::size_t row = 0; row < history.t.size(); ++row) {
    std::vector<double>& value = rearranged.value.emplace_back(to.size(), std::nan(""));
    std::vector<double>& sigma = rearranged.sigma.emplace_back(prior_sigma.begin(), prior_sigma.end());
    for (std::size_t column = 0; column < to.size(); ++column) {
      const auto found = std::ranges::find(from, to[column]) - from.begin();
      if (const auto i = static_cast<std::size_t>(found); i < from.size()) {
        value[column] = history.value[row][i];
        sigma[column] = history.sigma[row][i];
      }
    }
  }
  history = std::move(rearranged);
}

std::vector<FurtherEstimate> further_of(const PassProblem& problem, const BatchResult& result) {
  std::vector<FurtherEstimate> further;
  const Layout& on_board = problem.setup().on_board.layout;
  for (const ParameterId& parameter : further_parameters(on_board)) {
    further.push_back({parameter, value_of(on_board, result.solution.gyros, result.solution.shared, parameter),
                       result.errors.last_root.row(state_of(problem.layout(), parameter)).norm()});
  }
  return further;
}

/// What the uncertainty of the spectrum adds. With κ and δ given, what the pass tells of the other errors depends on no
/// spectrum: they follow κ and δ as they do along the pass. `root`: of all errors.
MatrixXd added_by_spectrum(const Layout& layout, const KappaAndDelta& parameters, const MatrixXd& root,
                           const MatrixXd& root_along) {
  const MatrixXd by_those_along = MatrixXd(root_along.transpose()).householderQr().solve(root.transpose()).transpose();
  MatrixXd by_parameters = multiply(by_those_along, parameters.to_states);
  by_parameters.middleRows(layout.drift(0), layout.parameters()).setIdentity();
  return multiply(multiply(by_parameters, parameters.added), by_parameters.transpose());
}

/// What is known of the errors at the last moment of the pass.
OpenLoopStart errors_at_end(const PassProblem& problem, const BatchResult& result, const PassProblem::Moment& last,
                            const KappaAndDelta& parameters) {
  const CalibrationSetup& setup = problem.setup().on_board;
  const Layout& own = problem.layout();
  const Layout& layout = setup.layout;
  MatrixXd by_states = MatrixXd::Zero(layout.shared(), own.size());
  for (int k = 0; k < layout.gyros; ++k) {
    by_states.middleRows<3>(layout.direction(k)) = problem.momentum_by_states(last, k);
  }
  const int wandering = own.drift(0) - own.wandering(0);
  by_states.block(layout.wandering(0), own.wandering(0), wandering, wandering).setIdentity();
  by_states.block(layout.drift(0), own.drift(0), layout.parameters(), own.parameters()) = parameters.by_states;
  const int rest = layout.shared() - layout.behind_parameters();
  by_states.block(layout.behind_parameters(), own.behind_parameters(), rest, rest).setIdentity();
  const MatrixXd root = multiply(by_states, result.errors.last_root);
  MatrixXd covariance = square(root);
  if (parameters.added.size() > 0) {
    covariance +=
        added_by_spectrum(layout, parameters, root, result.errors.last_root.middleRows(own.drift(0), own.parameters()));
  }
  // What the modes leave open of the members has moved no momentum.
  covariance.block(layout.drift(0), layout.drift(0), layout.parameters(), layout.parameters()) = parameters.covariance;
  return open_loop_start(setup, layout, last.gyros, std::move(covariance));
}

/// The problem of a screened pass. Throws SetupError where it has no solution.
PassProblem problem_of(const Screened& screened, PassSetup setup) {
  if (screened.pass.fixes.empty()) {
    throw SetupError("no fix could be compared with the gyros", "look at the telemetry with `trihedron inspect`");
  }
  if (screened.pass.clock_set_back) {
    throw SetupError("the clock of the telemetry was set back within the pass: how its parts lie in time is unknown",
                     "calibrate the parts apart, or use estimator invariant");
  }
  return {screened.pass, std::move(setup)};
}

/// The first solution, with the modes of the field in use.
PassSolution begin(PassProblem& problem, const Screened& screened, const CalibrationOptions& options,
                   const std::optional<FieldPrior>& field, const std::optional<Nearby>& nearby) {
  PassSolution first = nearby ? first_solution(problem, *nearby) : first_solution(problem, screened);
  if (options.drift_field) {
    if (!field) {  // the prior is an earlier calibration's: estimates begin there
      for (int k = 0; k < problem.layout().gyros; ++k) {
        first.gyros[k].drift_rad_s = problem.setup().prior.gyros[k].drift_rad_s;
      }
    }
    const MovedByModes by_coefficients = problem.moved_by_coefficients(first);
    problem.use(field ? field->modes : modes_of(problem, by_coefficients), by_coefficients);
  }
  return first;
}

}  // namespace

Refinement::Refinement(const Screened& screened, PassSetup setup, const CalibrationOptions& options,
                       const std::optional<FieldPrior>& field, const std::optional<Nearby>& nearby)
    : problem_(problem_of(screened, std::move(setup))),
      field_(field),
      result_(most_likely(problem_, begin(problem_, screened, options, field_, nearby))),
      halves_(compare_halves(problem_, result_)),
      roots_(roots_of(result_)) {
  const SmoothedAttitude smoothed(screened.pass, problem_, result_.solution, roots_);
  course_ = smoothed.course();
  if (options.definitive_attitude) {
    definitive_attitude_ = smoothed.definitive(course_.misfit);
  }
}

void Refinement::judge(std::vector<FixRecord>& fixes) const {
  use_residuals(problem_, result_.solution, roots_, fixes);
}

void Refinement::put_into(CalibrationRun& run) && {
  const Layout& layout = problem_.setup().on_board.layout;
  Calibration& calibration = run.calibration;
  const KappaAndDelta parameters = kappa_and_delta(problem_, result_, field_ ? field_->more_covariance : MatrixXd());
  // Rounding has taken what little the fixes say, where they contradict each other beyond any noise.
  if (!parameters.covariance.allFinite()) {
    throw SetupError("the fixes and samples that can be used do not determine the parameters",
                     "look at the telemetry with `trihedron inspect`: axes, units, the order of quaternions");
  }
  if (field_) {
    calibration.drift_field = field_->levels;
  }
  calibration.covariance = parameters.covariance;
  const PassProblem::Moment last = problem_.last_moment(result_.solution);
  calibration.t = last.t;
  for (int k = 0; k < layout.gyros; ++k) {
    calibration.gyros[static_cast<std::size_t>(k)].momentum_in = last.gyros[k].h_in;
  }
  run.errors = errors_at_end(problem_, result_, last, parameters);
  for (int k = 0; k < layout.gyros; ++k) {
    GyroCalibration& gyro = calibration.gyros[static_cast<std::size_t>(k)];
    const Eigen::Vector3d momentum_in = gyro.momentum_in;
    // The coefficients stand for the end of the pass.
    gyro = record_of(parameters.gyros[k], k, problem_.setup().on_board, 0);
    gyro.momentum_in = momentum_in;
  }
  calibration.estimator = Estimator::kBatch;
  const std::vector<ParameterId> states =
      drift_and_alignment(layout.drift_model, static_cast<std::size_t>(layout.gyros));
  rearrange(calibration.states, states, problem_.setup(), run.parameters);
  calibration.states = states;
  calibration.further = further_of(problem_, result_);
  if (layout.further.orbital_error) {
    calibration.orbital_rate_rad_s = problem_.setup().on_board.orbital_rate_rad_s;
  }
  if (halves_) {
    calibration.statistics.halves_chi_square = halves_->chi_square;
    calibration.statistics.halves_degrees_of_freedom = halves_->degrees_of_freedom;
  }
  calibration.statistics.batch_iterations = result_.iterations;
  calibration.statistics.batch_converged = result_.converged;
  judge(run.fixes);
  run.attitude = std::move(course_.attitude);
  run.definitive_attitude = std::move(definitive_attitude_);
}

}  // namespace trihedron::ground
