#include "batch/pass_problem.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "trihedron/core/invariant_estimator.hpp"
#include "trihedron/core/outlier_gate.hpp"
#include "trihedron/core/precession.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

using OnBoard = Cycle<InvariantEstimator<Esg7, 2>>;
/// 1-sigma of a direction of which nothing is known.
constexpr double kUnknown_rad = 1;

/// Columns: two unit vectors across h and across each other.
Eigen::Matrix<double, 3, 2> across(const Vector3d& h) {
  Eigen::Matrix<double, 3, 2> columns;
  columns.col(0) = h.unitOrthogonal();
  columns.col(1) = h.cross(columns.col(0));
  return columns;
}

GyroDirections in_c(const PassSolution& solution, const GyroDirections& h_b) {
  GyroDirections h_c;
  for (std::size_t k = 0; k < solution.gyros.size(); ++k) {
    const int gyro = static_cast<int>(k);
    h_c[gyro] = seen_in_c(solution.gyros[k], h_b[gyro]);
  }
  return h_c;
}

/// The same measurements in no more rows than there are states, and one for what is left over.
void compress(SmootherStage& stage) {
  const Eigen::Index states = stage.H.cols();
  if (stage.H.rows() > states + 1) {
    MatrixXd rows(stage.H.rows(), states + 1);
    rows << stage.H, stage.y;
    const MatrixXd triangle = triangle_of(rows);
    stage.H = triangle.leftCols(states);
    stage.y = triangle.col(states);
  }
}

/// White rows of fixes, those in a row that are near as one: their mean, by their weights.
class Together {
 public:
  explicit Together(Duration reach) : reach_(reach) {}

  void add(const ScreenedPass::Fix& fix, const PassProblem::FixRows& rows, double weight) {
    const bool first = sums_.empty() || fix.fix.t - sums_.back().t >= reach_ || sums_.back().head != fix.fix.head ||
                       !std::equal(fix.used.begin(), fix.used.end(), sums_.back().used.begin());
    Sum& sum = first ? sums_.emplace_back() : sums_.back();
    const double square = weight * weight;
    square_ += square * rows.y.squaredNorm();
    if (first) {
      sum = {fix.fix.t, fix.fix.head, fix.used, square, square * rows.H, square * rows.y};
      size_ += rows.y.size();
      return;
    }
    sum.weight += square;
    sum.H += square * rows.H;
    sum.y += square * rows.y;
  }

  /// Returns what of the squares is not in the rows: the scatter about the means.
  [[nodiscard]] double put_into(SmootherStage& stage, Eigen::Index states) const {
    stage.H.resize(size_, states);
    stage.y.resize(size_);
    Eigen::Index row = 0;
    for (const Sum& sum : sums_) {
      stage.H.middleRows(row, sum.y.size()) = sum.H / std::sqrt(sum.weight);
      stage.y.segment(row, sum.y.size()) = sum.y / std::sqrt(sum.weight);
      row += sum.y.size();
    }
    return square_ - stage.y.squaredNorm();
  }

 private:
  struct Sum {
    Time t{};  ///< of the first
    int head = 0;
    GyrosUsed used{};
    double weight = 0;
    MatrixXd H;
    VectorXd y;
  };
  Duration reach_;
  std::vector<Sum> sums_;
  Eigen::Index size_ = 0;
  double square_ = 0;
};

/// ω_b by κ with so much of its change.
Vector3d rate(const DriftFamily::Basis& basis, const GyroParameters& gyro, double part) {
  return basis * gyro.drift_rad_s + part * (basis.leftCols<Esg7::kSize>() * gyro.change_rad_s);
}

/// Small rotation across `from` that takes it to `to`.
Vector3d turn(const Vector3d& from, const Vector3d& to) { return from.cross(to); }

}  // namespace

PassProblem::PassProblem(const ScreenedPass& pass, PassSetup setup)
    : setup_(std::move(setup)), gyros_(setup_.layout.gyros) {
  const Time first = pass.fixes.front().fix.t;
  auto fix = pass.fixes.begin();
  Time taken = first;
  const auto add_fixes_until = [&](Time t) {
    for (; fix != pass.fixes.end() && fix->fix.t <= t; ++fix) {
      nodes_.push_back({fix->fix.t, fix->h_b, fix->used, &*fix, false});
      taken = fix->fix.t;
    }
  };
  Time before = first;
  bool after_gap = false;
  for (const ScreenedPass::Sample& sample : pass.samples) {
    if (sample.t <= first) {
      continue;
    }
    add_fixes_until(sample.t - Duration{1});  // on its own time after it
    after_gap = after_gap || sample.t - before > OnBoard::kMaxInterpolation;
    before = sample.t;
    const bool fix_follows = fix != pass.fixes.end() && fix->fix.t - sample.t < setup_.sample_step / 2;
    if (after_gap || (sample.t - taken >= setup_.sample_step && !fix_follows) || &sample == &pass.samples.back()) {
      nodes_.push_back({sample.t, sample.h_b, sample.used, nullptr, std::exchange(after_gap, false)});
      taken = sample.t;
    }
  }
  add_fixes_until(Time::max());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (arcs_.empty() || nodes_[i].after_gap || nodes_[i].t - nodes_[arcs_.back().begin].t >= setup_.arc) {
      arcs_.push_back({i, i});
    }
    arcs_.back().end = i + 1;
  }
}

double PassProblem::part_of_change(Time t) const {
  return to_seconds(t - nodes_.back().t) / to_seconds(nodes_.back().t - nodes_.front().t);
}

void PassProblem::begin_arc(const PassSolution& solution, std::size_t arc, Moment& moment) const {
  moment.arc = arc;
  moment.t = nodes_[arcs_[arc].begin].t;
  moment.h_in = solution.arcs[arc].h_in;
  moment.by.resize(static_cast<std::size_t>(gyros_));
  for (int k = 0; k < gyros_; ++k) {
    MomentumBy& by = moment.by[static_cast<std::size_t>(k)];
    by.direction = across(moment.h_in[k]);
    by.wandering.setZero();
    by.drift.setZero(3, setup_.layout.drift_size);
    by.change.setZero();
    by.alignment.setZero();
  }
}

void PassProblem::step(const PassSolution& solution, const Node& from, const Node& to, Moment& moment,
                       double& extra_variance_rad2) const {
  const double dt_s = to_seconds(to.t - from.t);
  const double part = part_of_change(from.t + (to.t - from.t) / 2);
  moment.t = to.t;
  // Gyros that can be used at both ends; where those are too few, at its end.
  GyrosUsed at_both = to.used;
  for (int k = 0; k < gyros_; ++k) {
    at_both[k] = from.used[k] && to.used[k];
  }
  const GyrosUsed used = count(at_both) >= 2 ? at_both : to.used;
  GyroDirections middle;
  for (int k = 0; k < gyros_; ++k) {
    middle[k] = at_both[k] ? (from.h_b[k] + to.h_b[k]).normalized() : used[k] ? to.h_b[k] : Vector3d::UnitX();
  }
  // The momenta in the middle of the step: those at its begin would be half a step behind all along.
  const GyroDirections seen_c = in_c(solution, middle);
  const auto at_begin = optimal_rotation<kMaxGyros>(moment.h_in, seen_c, used);
  GyroDirections h_middle = moment.h_in;
  if (at_begin) {
    for (int k = 0; k < gyros_; ++k) {
      const GyroParameters& gyro = solution.gyros[static_cast<std::size_t>(k)];
      const Vector3d omega_b =
          rate(setup_.family.basis(without_bias<double>(middle[k], gyro.readout_bias)), gyro, part) +
          solution.arcs[moment.arc].wandering_rad_s[k];
      h_middle[k] = rotated<double>(h_middle[k], at_begin.value().raw() * (gyro.C_c_b * omega_b) * (dt_s / 2));
    }
  }
  const auto attitude = optimal_rotation<kMaxGyros>(h_middle, seen_c, used);
  if (!attitude) {
    extra_variance_rad2 += kUnknown_rad * kUnknown_rad;
    return;
  }
  const Matrix3d C_in_c = attitude.value().raw();
  double largest_rad = 0;
  for (int k = 0; k < gyros_; ++k) {
    const auto index = static_cast<std::size_t>(k);
    const GyroParameters& gyro = solution.gyros[index];
    if (!used[k]) {  // its momentum turns all the same: what it would read at the attitude of the others
      middle[k] = gyro.C_c_b.transpose() * (C_in_c.transpose() * moment.h_in[k]) + gyro.readout_bias;
    }
    MomentumBy& by = moment.by[index];
    const Matrix3d C_in_b = C_in_c * gyro.C_c_b;
    const DriftFamily::Basis basis = C_in_b * setup_.family.basis(without_bias<double>(middle[k], gyro.readout_bias));
    const Vector3d turned = dt_s * (rate(basis, gyro, part) + C_in_b * solution.arcs[moment.arc].wandering_rad_s[k]);
    moment.h_in[k] = rotated<double>(moment.h_in[k], turned).normalized();
    const Matrix3d cross = skew<double>(turned);
    by.direction += (cross * by.direction).eval();
    by.wandering += cross * by.wandering + dt_s * C_in_b;
    by.drift += (cross * by.drift).eval() + dt_s * basis;
    by.change += cross * by.change + dt_s * part * basis.leftCols<Esg7::kSize>();
    by.alignment += cross * (by.alignment - C_in_c);
    if (to.after_gap) {
      const double seen_rad =
          dt_s < OnBoard::kQuarterOrbit_s ? angle_between<double>(from.h_b[k], to.h_b[k]) : std::numbers::pi;
      largest_rad = std::max(largest_rad, turned.norm() * seen_rad);
    }
  }
  extra_variance_rad2 += largest_rad * largest_rad;
}

PassSolution PassProblem::start(const std::vector<GyroParameters>& gyros) const {
  PassSolution solution;
  solution.gyros = gyros;
  solution.shared.setZero(setup_.layout.size() - setup_.layout.shared());
  solution.arcs.resize(arcs_.size());
  for (PassSolution::Arc& arc : solution.arcs) {
    for (int k = 0; k < kMaxGyros; ++k) {
      arc.h_in[k] = Vector3d::UnitX();
      arc.wandering_rad_s[k].setZero();
    }
  }
  const ScreenedPass::Fix& first = *nodes_.front().fix;
  const GyroDirections h_c = in_c(solution, first.h_b);
  for (int k = 0; k < gyros_; ++k) {
    const Vector3d seen = first.used[k] ? h_c[k] : gyros[static_cast<std::size_t>(k)].C_c_b.col(0);  // anywhere
    solution.arcs[0].h_in[k] = (first.fix.q_in_c.normalized() * seen).normalized();
  }
  Moment moment;
  double unused = 0;
  for (std::size_t arc = 0; arc < arcs_.size(); ++arc) {
    if (arc > 0) {
      solution.arcs[arc].h_in = moment.h_in;
    }
    begin_arc(solution, arc, moment);
    for (std::size_t i = arcs_[arc].begin; i + 1 < nodes_.size() && i < arcs_[arc].end; ++i) {
      step(solution, nodes_[i], nodes_[i + 1], moment, unused);
    }
  }
  return solution;
}

void PassProblem::go_along(const PassSolution& solution, const std::function<void(const Moment&)>& visit) const {
  Moment moment;
  double unused = 0;
  for (std::size_t arc = 0; arc < arcs_.size(); ++arc) {
    check_stop();
    begin_arc(solution, arc, moment);
    for (std::size_t i = arcs_[arc].begin; i < arcs_[arc].end; ++i) {
      if (i > arcs_[arc].begin) {
        step(solution, nodes_[i - 1], nodes_[i], moment, unused);
      }
      moment.fix = nodes_[i].fix;
      visit(moment);
    }
  }
}

Eigen::Matrix3Xd PassProblem::fix_by_shared(const ScreenedPass::Fix& fix) const {
  const PassLayout& layout = setup_.layout;
  Eigen::Matrix3Xd by = Eigen::Matrix3Xd::Zero(3, layout.size() - layout.shared());
  if (layout.clock_offset) {
    by.col(0) = fix.rate_c;
  }
  if (layout.orbital_error && fix.fix.head == 0) {
    const double phase = setup_.orbital_rate_rad_s * to_seconds(fix.fix.t - setup_.orbital_phase_zero);
    const int first = layout.orbital() - layout.shared();
    by.middleCols<3>(first) = std::sin(phase) * Matrix3d::Identity();
    by.middleCols<3>(first + 3) = std::cos(phase) * Matrix3d::Identity();
  }
  if (fix.fix.head > 0) {
    by.middleCols<3>(layout.head(fix.fix.head) - layout.shared()).setIdentity();
  }
  return by;
}

Result<AttitudeByDirections<kMaxGyros>, DirectionsFault> PassProblem::attitude(const PassSolution& solution,
                                                                               const Moment& moment,
                                                                               const GyroDirections& h_b,
                                                                               const GyrosUsed& used) {
  return optimal_attitude<kMaxGyros>(moment.h_in, in_c(solution, h_b), used);
}

MatrixXd PassProblem::attitude_by_states(const PassSolution& solution, const Moment& moment,
                                         const AttitudeByDirections<kMaxGyros>& attitude,
                                         const GyroDirections& h_b) const {
  const PassLayout& layout = setup_.layout;
  const GyroDirections h_c = in_c(solution, h_b);
  MatrixXd by_states = MatrixXd::Zero(3, layout.size());
  const Matrix3d C_c_in = attitude.C_in_c.raw().transpose();
  for (int k = 0; k < gyros_; ++k) {
    const MomentumBy& by = moment.by[static_cast<std::size_t>(k)];
    const GyroParameters& gyro = solution.gyros[static_cast<std::size_t>(k)];
    const Matrix3d by_direction = attitude.by_directions.middleCols<3>(3L * k);
    const Matrix3d by_phi = by_direction * C_c_in;
    by_states.middleCols<2>(PassLayout::direction(k)) = by_phi * by.direction;
    by_states.middleCols(layout.drift(k), layout.drift_size) = by_phi * by.drift;
    by_states.middleCols<3>(layout.alignment(k)) = by_phi * by.alignment - by_direction;
    if (layout.wandering_drift) {
      by_states.middleCols<3>(layout.wandering(k)) = by_phi * by.wandering;
    }
    if (layout.coefficient_change) {
      by_states.middleCols<Esg7::kSize>(layout.change(k)) = by_phi * by.change;
    }
    if (layout.readout_bias) {
      by_states.middleCols<3>(layout.bias(k)) = by_direction * skew<double>(h_c[k]) * gyro.C_c_b;
    }
  }
  return by_states;
}

PassProblem::FixRows PassProblem::compare(const PassSolution& solution, const Moment& moment) const {
  const PassLayout& layout = setup_.layout;
  const ScreenedPass::Fix& fix = *moment.fix;
  const Eigen::Matrix3Xd by_shared = fix_by_shared(fix);
  const Vector3d known_error = by_shared * solution.shared;
  const Matrix3d C_fix =
      (Rot<In, C>::assume(fix.fix.q_in_c.normalized()) * Rot<C, C>::exp(-Vec<C>::assume(known_error))).raw();
  const GyroDirections h_c = in_c(solution, fix.h_b);
  FixRows rows;
  const auto by_gyros = optimal_rotation<kMaxGyros>(moment.h_in, h_c, fix.used);
  if (!by_gyros) {
    rows.H.setZero(0, layout.size());
    return rows;
  }
  const Matrix3d C_in_c = by_gyros.value().raw();  // without the noise of the fix
  const int components = 2 * count(fix.used);
  rows.H.setZero(components, layout.size());
  rows.y.resize(components);
  rows.R.setZero(components, components);
  MatrixXd by_fix(components, 3);
  int row = 0;
  for (int k = 0; k < gyros_; ++k) {
    if (!fix.used[k]) {
      continue;
    }
    const MomentumBy& by = moment.by[static_cast<std::size_t>(k)];
    const Vector3d& h = moment.h_in[k];
    const Eigen::Matrix<double, 2, 3> T = across(h).transpose();
    const Eigen::Matrix<double, 2, 3> by_c = T * C_in_c;
    rows.y.segment<2>(row) = T * h.cross(C_fix * h_c[k]);
    rows.H.block<2, 2>(row, PassLayout::direction(k)) = T * by.direction;
    rows.H.block(row, layout.drift(k), 2, layout.drift_size) = T * by.drift;
    rows.H.block<2, 3>(row, layout.alignment(k)) = T * by.alignment - by_c;
    if (layout.wandering_drift) {
      rows.H.block<2, 3>(row, layout.wandering(k)) = T * by.wandering;
    }
    if (layout.coefficient_change) {
      rows.H.block<2, Esg7::kSize>(row, layout.change(k)) = T * by.change;
    }
    if (layout.readout_bias) {
      rows.H.block<2, 3>(row, layout.bias(k)) =
          T * skew<double>(h) * C_in_c * solution.gyros[static_cast<std::size_t>(k)].C_c_b;
    }
    by_fix.middleRows<2>(row) = by_c;
    const double noise_rad = setup_.readout_noise_rad[static_cast<std::size_t>(k)] * fix.noise_factor;
    rows.R.block<2, 2>(row, row).diagonal().setConstant(noise_rad * noise_rad);
    row += 2;
  }
  rows.H.rightCols(by_shared.cols()) = by_fix * by_shared;
  rows.R += by_fix * setup_.fix_noise[static_cast<std::size_t>(fix.fix.head)] * by_fix.transpose();
  return rows;
}

bool PassProblem::is_outlier(const FixRows& rows) const {
  return rows.y.dot(rows.R.llt().solve(rows.y)) >
         gate_of_freedom(std::max(static_cast<int>(rows.y.size()), 1), setup_.gate_nis);
}

void PassProblem::add_prior(const PassSolution& solution, Linear& linear) const {
  const PassLayout& layout = setup_.layout;
  VectorXd sigma = VectorXd::Constant(layout.size(), kUnknown_rad);
  VectorXd apart = VectorXd::Zero(layout.size());  // prior mean − solution
  const int own = layout.drift_size + 3;
  for (int k = 0; k < gyros_; ++k) {
    const GyroParameters& prior = setup_.prior.gyros[static_cast<std::size_t>(k)];
    const GyroParameters& gyro = solution.gyros[static_cast<std::size_t>(k)];
    apart.segment(layout.drift(k), layout.drift_size) = prior.drift_rad_s - gyro.drift_rad_s;
    apart.segment<3>(layout.alignment(k)) =
        Rot<C, C>::assume(Matrix3d(prior.C_c_b * gyro.C_c_b.transpose())).log().raw();
    if (layout.readout_bias) {
      sigma.segment<3>(layout.bias(k)).setConstant(setup_.readout_bias_sigma);
      apart.segment<3>(layout.bias(k)) = prior.readout_bias - gyro.readout_bias;
    }
    if (layout.coefficient_change) {
      sigma.segment<Esg7::kSize>(layout.change(k)).setConstant(setup_.coefficient_change_sigma_rad_s);
      apart.segment<Esg7::kSize>(layout.change(k)) = prior.change_rad_s - gyro.change_rad_s;
    }
  }
  apart.tail(solution.shared.size()) = -solution.shared;
  if (layout.clock_offset) {
    sigma(layout.clock()) = setup_.clock_offset_sigma_s;
  }
  if (layout.orbital_error) {
    sigma.segment<6>(layout.orbital()).setConstant(setup_.orbital_error_sigma_rad);
  }
  for (int head = 1; head <= layout.further_heads; ++head) {
    sigma.segment<3>(layout.head(head))
        .setConstant(setup_.head_alignment_sigma_rad[static_cast<std::size_t>(head - 1)]);
  }
  linear.prior = sigma.cwiseInverse().asDiagonal();
  // Nothing is known before of the directions at the start, where the first fix shows them.
  for (int k = 0; k < gyros_; ++k) {
    if (nodes_.front().fix->used[k]) {
      linear.prior.middleRows<2>(PassLayout::direction(k)).setZero();
    }
  }
  const Eigen::Index size = static_cast<Eigen::Index>(gyros_) * own;
  linear.prior.block(layout.drift(0), layout.drift(0), size, size) =
      setup_.prior.covariance.llt().matrixL().solve(MatrixXd::Identity(size, size));
  linear.prior_y = linear.prior * apart;
}

void PassProblem::end_arc(const PassSolution& solution, const Moment& moment, double extra_variance_rad2,
                          Linear& linear) const {
  const PassLayout& layout = setup_.layout;
  const int d = layout.dynamic();
  SmootherStage& stage = linear.stages[moment.arc];
  Linear::ArcEnd& end = linear.ends.emplace_back();
  end.A.setZero(d, d);
  end.duration_s = to_seconds(moment.t - nodes_[arcs_[moment.arc].begin].t);
  end.extra_variance_rad2 = extra_variance_rad2;
  stage.B.setZero(d, layout.constants());
  stage.m.setZero(d);
  const PassSolution::Arc& next = solution.arcs[moment.arc + 1];
  for (int k = 0; k < gyros_; ++k) {
    const MomentumBy& by = moment.by[static_cast<std::size_t>(k)];
    const Eigen::Matrix<double, 2, 3> T = across(next.h_in[k]).transpose();
    const int row = PassLayout::direction(k);
    end.A.block<2, 2>(row, row) = T * by.direction;
    stage.B.block(row, layout.drift(k) - d, 2, layout.drift_size) = T * by.drift;
    stage.B.block<2, 3>(row, layout.alignment(k) - d) = T * by.alignment;
    if (layout.coefficient_change) {
      stage.B.block<2, Esg7::kSize>(row, layout.change(k) - d) = T * by.change;
    }
    stage.m.segment<2>(row) = T * turn(next.h_in[k], moment.h_in[k]);
    if (layout.wandering_drift) {
      end.A.block<2, 3>(row, layout.wandering(k)) = T * by.wandering;
    }
  }
}

void PassProblem::put_noise(const PassSolution& solution, const ProcessNoise& noise, Linear& linear) const {
  const PassLayout& layout = setup_.layout;
  const double walk = noise.direction_random_walk_rad_sqrt_s;
  if (layout.wandering_drift) {
    for (int k = 0; k < gyros_; ++k) {
      const int row = layout.wandering(k);
      linear.prior.block<3, 3>(row, row) = 1 / noise.wandering_sigma_rad_s * Matrix3d::Identity();
      linear.prior_y.segment<3>(row) = -solution.arcs[0].wandering_rad_s[k] / noise.wandering_sigma_rad_s;
    }
  }
  for (std::size_t arc = 0; arc < linear.ends.size(); ++arc) {
    Linear::ArcEnd& end = linear.ends[arc];
    SmootherStage& stage = linear.stages[arc];
    // Nothing is left of wandering drift after a long time; what A⁻¹ takes for that would be rounding.
    const double kept = std::max(std::exp(-end.duration_s / noise.wandering_time_s), 1e-6);
    stage.noise.setZero(layout.dynamic());
    stage.noise.head(2L * gyros_).setConstant(std::sqrt(walk * walk * end.duration_s + end.extra_variance_rad2));
    if (layout.wandering_drift) {
      for (int k = 0; k < gyros_; ++k) {
        const int row = layout.wandering(k);
        end.A.block<3, 3>(row, row) = kept * Matrix3d::Identity();
        stage.m.segment<3>(row) =
            kept * solution.arcs[arc].wandering_rad_s[k] - solution.arcs[arc + 1].wandering_rad_s[k];
        stage.noise.segment<3>(row).setConstant(noise.wandering_sigma_rad_s * std::sqrt(1 - kept * kept));
      }
    }
    stage.A_inverse = end.A.inverse();
  }
}

PassProblem::Linear PassProblem::linearise(const PassSolution& solution) const {
  Linear linear;
  add_prior(solution, linear);
  linear.stages.resize(arcs_.size());
  Moment moment;
  std::vector<std::pair<const ScreenedPass::Fix*, FixRows>> fixes;
  std::vector<double> nis_per_component;
  std::vector<std::size_t> fixes_until;
  for (std::size_t arc = 0; arc < arcs_.size(); ++arc) {
    check_stop();
    begin_arc(solution, arc, moment);
    double extra_variance_rad2 = 0;
    for (std::size_t i = arcs_[arc].begin; i < arcs_[arc].end; ++i) {
      moment.fix = nodes_[i].fix;
      if (moment.fix != nullptr) {
        FixRows& rows = fixes.emplace_back(moment.fix, compare(solution, moment)).second;
        const Eigen::LLT<MatrixXd> root(rows.R);
        root.matrixL().solveInPlace(rows.H);
        root.matrixL().solveInPlace(rows.y);
        if (rows.y.size() > 0) {
          nis_per_component.push_back(rows.y.squaredNorm() / static_cast<double>(rows.y.size()));
        }
      }
      if (i + 1 < nodes_.size()) {
        step(solution, nodes_[i], nodes_[i + 1], moment, extra_variance_rad2);
      }
    }
    fixes_until.push_back(fixes.size());
    if (arc + 1 < arcs_.size()) {
      end_arc(solution, moment, extra_variance_rad2, linear);
    } else {
      linear.stages[arc].m.setZero(setup_.layout.dynamic());
    }
  }
  // Far from the solution all fixes are off: what is far among them is an outlier.
  constexpr double kMedianOfFour = 0.84;  // of χ²/n; nearer to 1 for more
  double scale = 1;
  std::vector<double> sorted = nis_per_component;
  if (!sorted.empty()) {
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    scale = std::max(*middle / kMedianOfFour, 1.0);
  }
  std::size_t fix = 0;
  for (std::size_t arc = 0; arc < arcs_.size(); ++arc) {
    check_stop();
    Together together(setup_.fixes_together);
    for (; fix < fixes_until[arc]; ++fix) {
      const auto& [its, rows] = fixes[fix];
      if (rows.y.size() == 0) {
        continue;
      }
      // Its pull falls with the third power of the misfit beyond the gate.
      const double nis = rows.y.squaredNorm();
      const double gate = scale * gate_of_freedom(static_cast<int>(rows.y.size()), setup_.gate_nis);
      linear.beside_square += nis > gate ? 2 * gate * (1 - gate / nis) : 0;
      together.add(*its, rows, nis > gate ? gate / nis : 1);
    }
    linear.beside_square += together.put_into(linear.stages[arc], setup_.layout.size());
  }
  std::ranges::for_each(linear.stages, compress);
  put_noise(solution, setup_.noise, linear);
  return linear;
}

GyroParameters PassProblem::corrected(GyroParameters parameters, int gyro, const VectorXd& x) const {
  const PassLayout& layout = setup_.layout;
  parameters.drift_rad_s += x.segment(layout.drift(gyro), layout.drift_size);
  const Matrix3d turn = Rot<C, C>::exp(Vec<C>::assume(Vector3d(x.segment<3>(layout.alignment(gyro))))).raw();
  parameters.C_c_b = Eigen::Quaterniond(turn * parameters.C_c_b).normalized().toRotationMatrix();
  if (layout.readout_bias) {
    parameters.readout_bias += x.segment<3>(layout.bias(gyro));
  }
  if (layout.coefficient_change) {
    parameters.change_rad_s += x.segment<Esg7::kSize>(layout.change(gyro));
  }
  return parameters;
}

void PassProblem::correct(const SmootherResult& found, PassSolution& solution) const {
  const PassLayout& layout = setup_.layout;
  for (std::size_t arc = 0; arc < arcs_.size(); ++arc) {
    const VectorXd& x = found.x[arc];
    PassSolution::Arc& its = solution.arcs[arc];
    for (int k = 0; k < gyros_; ++k) {
      its.h_in[k] =
          rotated<double>(its.h_in[k], across(its.h_in[k]) * x.segment<2>(PassLayout::direction(k))).normalized();
      if (layout.wandering_drift) {
        its.wandering_rad_s[k] += x.segment<3>(layout.wandering(k));
      }
    }
  }
  const VectorXd& x = found.x.back();
  for (int k = 0; k < gyros_; ++k) {
    GyroParameters& gyro = solution.gyros[static_cast<std::size_t>(k)];
    gyro = corrected(gyro, k, x);
  }
  solution.shared += x.tail(solution.shared.size());
}

}  // namespace trihedron::ground
