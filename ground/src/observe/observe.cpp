#include "trihedron/ground/observe/observe.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "batch/batch.hpp"
#include "batch/pass_setup.hpp"
#include "choose/decide.hpp"
#include "model/drift_on_board.hpp"
#include "model/nothing_used.hpp"
#include "model/orbital_rate.hpp"
#include "model/setup.hpp"
#include "observe/angle_row.hpp"
#include "observe/attitude_metric.hpp"
#include "observe/combinations.hpp"
#include "onboard/screen.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kTimes = 20;

/// In the order of the layout.
std::vector<ParameterId> constants_of(const Layout& layout) {
  std::vector<ParameterId> constants = drift_and_alignment(layout.drift_model, static_cast<std::size_t>(layout.gyros));
  std::vector<ParameterId> further = further_parameters(layout);
  std::ranges::sort(further, {}, [&](const ParameterId& parameter) { return state_of(layout, parameter); });
  constants.insert(constants.end(), further.begin(), further.end());
  return constants;
}

/// Roots of the information by the measurements alone, at these stages.
std::vector<MatrixXd> measured(const PassProblem::Linear& linear, Index constants,
                               const std::vector<std::size_t>& after) {
  MatrixXd prior = linear.prior;
  prior.rightCols(constants).setZero();
  return information_on_constants(prior, linear.stages, after);
}

/// A square root of the covariance by both, root rootᵀ.
MatrixXd covariance_root(const MatrixXd& prior_root, const MatrixXd& measured_root) {
  const Index size = prior_root.cols();
  MatrixXd rows(prior_root.rows() + measured_root.rows(), size);
  rows << prior_root, measured_root;
  return triangle_of(rows).triangularView<Eigen::Upper>().solve(MatrixXd::Identity(size, size));
}

VectorXd sigmas(const MatrixXd& prior_root, const MatrixXd& measured_root) {
  return covariance_root(prior_root, measured_root).rowwise().norm();
}

BodyRotation mean_rotation(const std::vector<ScreenedPass::Fix>& fixes) {
  constexpr double kClose_s = 60;
  Eigen::Vector3d turned_c = Eigen::Vector3d::Zero();
  double time_s = 0;
  for (std::size_t i = 1; i < fixes.size(); ++i) {
    const StarFix& before = fixes[i - 1].fix;
    const StarFix& after = fixes[i].fix;
    const double step_s = to_seconds(after.t - before.t);
    if (step_s < kClose_s && before.head == after.head) {
      turned_c += Rot<C, C>::assume((before.q_in_c.conjugate() * after.q_in_c).normalized()).log().raw();
      time_s += step_s;
    }
  }
  const double rate_rad_s = time_s > 0 ? turned_c.norm() / time_s : 0;
  BodyRotation rotation;
  if (rate_rad_s > 0.1 * kLowOrbit_rad_s) {
    rotation.axis_c = turned_c.normalized();
    rotation.is_orbital = std::abs(rate_rad_s / kLowOrbit_rad_s - 1) < 0.3;
  }
  return rotation;
}

/// The problem as if only one reading were used at each fix.
ScreenedPass with_single_readings(ScreenedPass pass) {
  for (ScreenedPass::Fix& fix : pass.fixes) {
    fix.noise_factor = 1;
  }
  return pass;
}

/// Adds the angle between the momenta at the samples between fixes.
void add_angles(const PassProblem& problem, const ScreenedPass& pass, const PassSolution& solution,
                Duration gyro_period, PassProblem::Linear& linear) {
  const PerGyro<double>& readout_noise_rad = problem.setup().on_board.readout_noise_rad;
  const double noise_rad = std::hypot(readout_noise_rad[0], readout_noise_rad[1]);
  Time before = pass.samples.t(0);
  std::vector<Eigen::RowVectorXd> rows;
  std::size_t arc = 0;
  const auto close_arc = [&] {
    SmootherStage& stage = linear.stages[arc];
    const Index there = stage.H.rows();
    stage.H.conservativeResize(there + static_cast<Index>(rows.size()), Eigen::NoChange);
    stage.y.conservativeResize(stage.H.rows());
    stage.y.tail(static_cast<Index>(rows.size())).setZero();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      stage.H.row(there + static_cast<Index>(i)) = rows[i];
    }
    rows.clear();
  };
  problem.go_along(solution, [&](const PassProblem::Moment& moment) {
    if (moment.arc != arc) {
      close_arc();
      arc = moment.arc;
    }
    const std::size_t sample = pass.samples.from(moment.t);
    if (moment.fix == nullptr && sample < pass.samples.size() && pass.samples.used(sample)[0] &&
        pass.samples.used(sample)[1]) {
      // One row represents all samples since the last one.
      const double samples = std::max(std::round(to_seconds(moment.t - before) / to_seconds(gyro_period)), 1.0);
      const AngleRow row = angle_row(problem, moment, pass.samples.h_b(sample));
      rows.emplace_back(row.by_states * (std::sqrt(samples) / (row.noise_factor * noise_rad)));
    }
    before = moment.t;
  });
  close_arc();
}

VectorXd angle_gain(const Pass& pass, const Screened& screened, const PassSetup& setup, const PassSolution& solution) {
  const Index constants = setup.layout().constants();
  const ScreenedPass single = with_single_readings(screened.pass);
  const PassProblem problem(single, setup);
  PassProblem::Linear linear = problem.linearise(solution);
  const MatrixXd prior_root = linear.prior.bottomRightCorner(constants, constants);
  const std::vector<std::size_t> last = {linear.stages.size() - 1};
  const VectorXd without = sigmas(prior_root, measured(linear, constants, last).back());
  add_angles(problem, single, solution, pass.settings.gyro_period, linear);
  return without.cwiseQuotient(sigmas(prior_root, measured(linear, constants, last).back()));
}

/// The last stage of each of kTimes parts of the pass.
std::vector<std::size_t> ends_of_parts(std::size_t stages) {
  std::vector<std::size_t> ends;
  const std::size_t parts = std::min(kTimes, stages);
  for (std::size_t i = 1; i <= parts; ++i) {
    ends.push_back(i * stages / parts - 1);
  }
  return ends;
}

/// A pass linearised at its solution.
struct Linearised {
  const PassProblem& problem;
  const BatchResult& found;
  MatrixXd prior_root;

  [[nodiscard]] Index constants() const { return prior_root.cols(); }
};

/// Sigmas by the measurements until the end of each part of the pass; gives the root of the information by all.
MatrixXd add_course(const Linearised& at, Observability& result) {
  const PassProblem::Linear& linear = at.found.linear;
  const std::vector<std::size_t> ends = ends_of_parts(linear.stages.size());
  const std::vector<MatrixXd> roots = measured(linear, at.constants(), ends);
  for (const MatrixXd& root : roots) {
    result.sigma_until.push_back(sigmas(at.prior_root, root));
  }
  at.problem.go_along(at.found.solution, [&, part = std::size_t{0}](const PassProblem::Moment& moment) mutable {
    part += moment.arc > ends[part] ? 1U : 0U;
    result.t.resize(part + 1);
    result.t[part] = moment.t;
  });
  const MatrixXd root = covariance_root(at.prior_root, roots.back());
  result.covariance = root * root.transpose();
  result.sigma = result.sigma_until.back();
  return roots.back();
}

/// Lists the weak combinations. `scaled_root`: of the information by the measurements, in units of the prior sigmas.
void add_combinations(const MatrixXd& scaled_root, const BodyRotation& rotation, double tolerable_rad,
                      Observability& result) {
  const Eigen::JacobiSVD<MatrixXd> svd(scaled_root, Eigen::ComputeFullV);
  const VectorXd& values = svd.singularValues();
  result.singular_values = values;
  const double rounding = values(0) * static_cast<double>(values.size()) * std::numeric_limits<double>::epsilon();
  result.rank = (values.array() > rounding).count();
  const MatrixXd scaled_metric =
      result.prior_sigma.asDiagonal() * result.attitude_metric * result.prior_sigma.asDiagonal();
  const ParameterBlocks blocks(result.parameters);
  // Each kind separately: rotated together, an unobservable combination could be spread over weak ones.
  const Index unobservable = (values.array() < Observability::kUnobservable).count();
  const Index weak = (values.array() < Observability::kWeak).count() - unobservable;
  for (const auto& [first, size] :
       {std::pair{values.size() - unobservable, unobservable}, std::pair{values.size() - unobservable - weak, weak}}) {
    const MatrixXd columns = blocks.separated(svd.matrixV().middleCols(first, size));
    const auto begin = static_cast<std::ptrdiff_t>(result.weak.size());
    for (Index i = 0; i < size; ++i) {
      const VectorXd direction = columns.col(i);
      const double s = (scaled_root * direction).norm();
      const double error_rad = std::sqrt(direction.dot(scaled_metric * direction) / (1 + s * s));
      const bool is_unobservable = s < Observability::kUnobservable;
      result.weak.push_back({blocks.in_words(direction, result.prior_sigma, rotation), blocks.named(direction),
                             blocks.is_alignment(direction), s, error_rad, is_unobservable,
                             is_unobservable && error_rad > tolerable_rad});
    }
    std::sort(result.weak.begin() + begin, result.weak.end(),
              [](const Combination& a, const Combination& b) { return a.attitude_error_rad > b.attitude_error_rad; });
  }
}

/// A pass without faults as if it had been screened: its samples and fixes, in the order of their times.
ScreenedPass as_it_is(const Pass& pass, int gyros, int heads) {
  ScreenedPass screened(pass.gyro, gyros);
  for (std::size_t i = 0; i < pass.gyro.size(); ++i) {
    screened.samples.add(i, all_gyros(gyros));
  }
  for (int head = 0; head < heads; ++head) {
    const StarTrackerTelemetry& fixes = pass.fixes_of(static_cast<std::size_t>(head));
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      const std::size_t sample = screened.samples.from(fixes.t[i]);
      if (sample == screened.samples.size()) {
        break;
      }
      ScreenedPass::Fix& fix = screened.fixes.emplace_back();
      fix.fix = {fixes.t[i], fixes.q_in_c[i], head};
      fix.h_b = screened.samples.h_b(sample);
      fix.used = screened.samples.used(sample);
      if (i > 0) {
        fix.rate_c = Rot<C, C>::assume(fixes.q_in_c[i - 1].conjugate() * fixes.q_in_c[i]).log().raw() /
                     to_seconds(fixes.t[i] - fixes.t[i - 1]);
      }
    }
  }
  std::ranges::stable_sort(screened.fixes, [](const auto& a, const auto& b) { return a.fix.t < b.fix.t; });
  return screened;
}

}  // namespace

double sigma_along(const Combination& combination, const Observability& observability,
                   const Eigen::MatrixXd& covariance) {
  const VectorXd by_parameter = combination.direction.cwiseQuotient(observability.prior_sigma);
  const double size = combination.direction.cwiseProduct(observability.prior_sigma).norm();
  return size * std::sqrt(by_parameter.dot(covariance * by_parameter));
}

bool Observability::is_harmful() const {
  return std::ranges::any_of(weak, [](const Combination& combination) { return combination.is_harmful; });
}

Observability observe(const Pass& pass, const CalibrationOptions& asked, const Mission& mission) {
  Decision decision = decide(pass, asked);
  if (decision.field) {  // what a pass can show is told of a model with few members
    use(drift_on_board(decision.field->members), decision.options);
  }
  const CalibrationOptions& options = decision.options;
  const Screened screened = decision.screened ? std::move(*decision.screened) : screen(pass, options);
  if (screened.pass.fixes.empty()) {
    throw nothing_used(screen(pass, options, true).run->recorder.run().fixes);
  }
  PassSetup setup = pass_setup(pass.settings, options);
  setup.long_step = setup.sample_step;  // what the angles between the momenta tell is that of samples between fixes
  const PassProblem problem(screened.pass, std::move(setup));
  const BatchResult found = most_likely(problem, first_solution(problem, screened));
  const Layout& layout = problem.layout();
  const Linearised at{problem, found, found.linear.prior.bottomRightCorner(layout.constants(), layout.constants())};

  Observability result;
  result.options = options;
  result.options.find_noise = false;
  result.parameters = constants_of(layout);
  result.prior_sigma = sigmas(at.prior_root, MatrixXd::Zero(1, at.constants()));
  const MatrixXd root = add_course(at, result);
  if (layout.gyros == 2) {
    result.angle_gain = angle_gain(pass, screened, problem.setup(), found.solution);
  }
  result.attitude_metric = attitude_metric(problem, found.solution, found.linear, mission);
  result.attitude_error_rad = std::sqrt((result.attitude_metric * result.covariance).trace());
  add_combinations(root * result.prior_sigma.asDiagonal(), mean_rotation(screened.pass.fixes), mission.tolerable_rad,
                   result);
  return result;
}

Eigen::MatrixXd predicted_covariance(const Pass& exact, const CalibrationOptions& options) {
  PassSetup setup = pass_setup(exact.settings, options);
  setup.sample_step = std::chrono::seconds(3);  // in slews a body turns by a degree or two
  const ScreenedPass screened = as_it_is(exact, setup.layout().gyros, setup.layout().star_trackers);
  if (screened.fixes.empty()) {
    throw nothing_used({});
  }
  const PassProblem problem(screened, setup);
  const PassProblem::Linear linear = problem.linearise(problem.start(setup.prior.gyros));
  const Index constants = setup.layout().constants();
  const MatrixXd prior_root = linear.prior.bottomRightCorner(constants, constants);
  const MatrixXd root = covariance_root(prior_root, measured(linear, constants, {linear.stages.size() - 1}).back());
  return root * root.transpose();
}

}  // namespace trihedron::ground
