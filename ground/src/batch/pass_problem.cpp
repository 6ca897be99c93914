#include "batch/pass_problem.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "linear/gram.hpp"
#include "model/scatter.hpp"
#include "trihedron/core/outlier_gate.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"
#include "trihedron/records/stop.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// 1-sigma of a direction of which nothing is known.
constexpr double kUnknown_rad = 1;

/// Reduces the rows of a stage to a triangle: no more rows than states, and one for the residual.
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

/// Of a misfit with this covariance.
double nis_of(const VectorXd& y, const MatrixXd& R) { return y.dot(R.llt().solve(y)); }

/// Small rotation, across `from`, that turns it into `to`.
Vector3d turn(const Vector3d& from, const Vector3d& to) { return from.cross(to); }

/// ω_b of a gyro in an arc.
Vector3d rate_of(const RotorDrift& rotor, const Gyro& gyro, const Vector3d& h, const DriftTime& time,
                 const Layout& layout) {
  const Vector3d rate = rotor.rate(h, time);
  return layout.further.wandering_drift ? Vector3d(rate + gyro.drift_rad_s.segment<3>(layout.wandering_column()))
                                        : rate;
}

/// Whether the readings of all gyros that are used at both ends have turned by less than that.
bool turned_less(const Directions& from, const Directions& to, const GyroMask& used, int gyros, double turn_rad) {
  bool less = true;
  for (int k = 0; k < gyros; ++k) {
    less = less && (!used[k] || (to[k] - from[k]).norm() < turn_rad);
  }
  return less;
}

}  // namespace

/// Collects whitened rows of fixes of an arc; consecutive fixes closer than the setup says, between which the body has
/// not turned by more than that, and with the same covariance, are replaced by their weighted mean. Between the first
/// and the last of these how the momenta depend on the states of the arc is taken to be linear in time, so that the
/// rows about states are made once for each mean, those about modes as well.
class PassProblem::FixMerger {
 public:
  /// `beside`: columns of rows that are not about states; may be none.
  explicit FixMerger(const PassProblem& problem, Beside beside = {}) : problem_(problem), beside_(std::move(beside)) {}

  /// For another arc.
  void clear() {
    sums_.clear();
    turned_rad_ = 0;
    size_ = 0;
    square_ = 0;
  }

  /// `whitened`: rows as on board, right side last.
  void add(const Moment& moment, const Rows& whitened, double weight) {
    const ScreenedPass::Fix& fix = *moment.fix;
    const PassSetup& setup = problem_.setup_;
    turned_rad_ += sums_.empty() ? 0 : fix.rate_c.norm() * to_seconds(fix.fix.t - last_);
    const bool first = sums_.empty() || fix.fix.t - sums_.back().t >= setup.fixes_together ||
                       turned_rad_ > setup.turn_together_rad || sums_.back().head != fix.fix.head ||
                       sums_.back().covariance != fix.fix.covariance.rad2 ||
                       !std::equal(fix.used.begin(), fix.used.end(), sums_.back().used.begin());
    turned_rad_ = first ? 0 : turned_rad_;
    if (first) {
      finish();
    }
    Sum& sum = first ? sums_.emplace_back() : sums_.back();
    const double square = weight * weight;
    const Index states = whitened.cols() - 1;
    const auto y = whitened.col(states);
    square_ += square * y.squaredNorm();
    if (first) {
      sum.t = fix.fix.t;
      sum.head = fix.fix.head;
      sum.covariance = fix.fix.covariance.rad2;
      sum.used = fix.used;
      sum.y.setZero(y.size());
      size_ += y.size();
      now_.setZero(y.size(), states);
      late_s_.setZero(y.size(), states);
      take(moment, at_first_);
    }
    last_ = fix.fix.t;
    take(moment, at_last_);
    sum.weight += square;
    sum.y += square * y;
    now_ += square * whitened.leftCols(states);
    const double late_s = square * to_seconds(last_ - sum.t);
    for (int k = 0; k < problem_.gyros_; ++k) {
      const int at = problem_.on_board_.direction(k);
      late_s_.middleCols<3>(at) += late_s * whitened.middleCols<3>(at);
    }
    if (problem_.modes_) {
      const MovedByModes::Place at = problem_.moved_by_modes_.place(moment.arc, moment.t);
      sum.add_moved(at.before, square * (1 - at.part), whitened, problem_.on_board_);
      if (at.part > 0) {
        sum.add_moved(at.before + 1, square * at.part, whitened, problem_.on_board_);
      }
    }
    if (beside_) {
      const MatrixXd by_states = problem_.by_states_but_modes(moment, whitened.leftCols(states));
      const MatrixXd columns = square * beside_(moment, problem_.without_modes_, by_states);
      sum.beside = first ? columns : MatrixXd(sum.beside + columns);
    }
  }

  /// The columns beside the rows that put_into() writes.
  [[nodiscard]] MatrixXd beside() const {
    MatrixXd columns(size_, sums_.empty() ? 0 : sums_.front().beside.cols());
    Eigen::Index row = 0;
    for (const Sum& sum : sums_) {
      columns.middleRows(row, sum.y.size()) = sum.beside / std::sqrt(sum.weight);
      row += sum.y.size();
    }
    return columns;
  }

  /// Writes the rows; returns the sum of squares about the means, which the rows do not contain.
  [[nodiscard]] double put_into(std::size_t arc, SmootherStage& stage) {
    finish();
    stage.H.resize(size_, problem_.layout_.size());
    stage.y.resize(size_);
    Eigen::Index row = 0;
    for (const Sum& sum : sums_) {
      auto H = stage.H.middleRows(row, sum.y.size());
      problem_.put_beside_modes(sum.H / std::sqrt(sum.weight), H);
      stage.y.segment(row, sum.y.size()) = sum.y / std::sqrt(sum.weight);
      row += sum.y.size();
    }
    for (int k = 0; problem_.modes_ && k < problem_.gyros_; ++k) {
      put_modes_into(arc, k, stage.H);
    }
    return square_ - stage.y.squaredNorm();
  }

 private:
  /// Makes the rows about states of the last sum, once it is complete.
  void finish() {
    if (sums_.empty()) {
      return;
    }
    MatrixXd& H = sums_.back().H;
    if (const double span_s = to_seconds(last_ - sums_.back().t); span_s > 0) {
      const Rows at_last = late_s_ / span_s;
      now_ -= at_last;
      H = problem_.by_states_but_modes(at_first_, now_) + problem_.by_states_but_modes(at_last_, at_last);
    } else {
      H = problem_.by_states_but_modes(at_first_, now_);
    }
  }

  /// All rows about how far a momentum has moved at the moments of the table, times how far the modes move it there.
  void put_modes_into(std::size_t arc, int gyro, MatrixXd& H) const {
    const auto moments = static_cast<Eigen::Index>(problem_.moved_by_modes_.size(arc));
    const int modes = problem_.modes_->size();
    MatrixXd by_moved = MatrixXd::Zero(size_, 3 * moments);
    Eigen::Index row = 0;
    for (const Sum& sum : sums_) {
      for (const Moved& moved : sum.moved) {
        by_moved.block(row, 3 * static_cast<Eigen::Index>(moved.number), sum.y.size(), 3) =
            moved.by[gyro] / std::sqrt(sum.weight);
      }
      row += sum.y.size();
    }
    MatrixXd moved_by_modes(3 * moments, modes);
    for (Eigen::Index i = 0; i < moments; ++i) {
      moved_by_modes.middleRows<3>(3 * i) =
          problem_.moved_by_modes_.added(arc, static_cast<std::size_t>(i), gyro).cast<double>();
    }
    H.middleCols(problem_.layout_.drift(gyro) + Layout::kEq1, modes) = multiply(by_moved, moved_by_modes);
  }

  /// Rows about how far the momenta have moved at one moment of the table.
  struct Moved {
    std::size_t number = 0;
    PerGyro<Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxComponents, 3>> by;
  };
  struct Sum {
    Time t{};  ///< of the first
    int head = 0;
    decltype(FixCovariance::rad2) covariance{};
    GyroMask used{};
    double weight = 0;
    MatrixXd H;  ///< without modes
    MatrixXd beside;
    VectorXd y;
    std::vector<Moved> moved;

    /// `rows`: as on board.
    void add_moved(std::size_t number, double factor, const Rows& rows, const Layout& layout) {
      auto at = std::ranges::find(moved, number, &Moved::number);
      if (at == moved.end()) {
        at = moved.insert(at, Moved{number, {}});
        for (int k = 0; k < layout.gyros; ++k) {
          at->by[k].setZero(rows.rows(), 3);
        }
      }
      for (int k = 0; k < layout.gyros; ++k) {
        at->by[k] += factor * rows.middleCols<3>(layout.direction(k));
      }
    }
  };
  /// Copies what the rows of the problem need.
  void take(const ByStatesOfArc& from, ByStatesOfArc& to) const {
    const int columns = problem_.on_board_.drift_columns();
    for (int k = 0; k < problem_.gyros_; ++k) {
      to.since[k].by_start = from.since[k].by_start;
      to.since[k].by_drift.first(columns) = from.since[k].by_drift.first(columns);
      to.since[k].by_alignment = from.since[k].by_alignment;
      to.directions[k] = from.directions[k];
    }
  }

  const PassProblem& problem_;
  Beside beside_;
  double turned_rad_ = 0;  ///< since the first of the last sum
  std::vector<Sum> sums_;
  // Of the last sum:
  Time last_{};
  Rows now_;     ///< its rows about the states at each fix
  Rows late_s_;  ///< those about directions, times how much later than the first each fix is
  ByStatesOfArc at_first_;
  ByStatesOfArc at_last_;
  Eigen::Index size_ = 0;
  double square_ = 0;
};

Eigen::Matrix<double, 3, 2> across(const Vector3d& h) {
  Eigen::Matrix<double, 3, 2> columns;
  columns.col(0) = h.unitOrthogonal();
  columns.col(1) = h.cross(columns.col(0));
  return columns;
}

PassProblem::PassProblem(const ScreenedPass& pass, PassSetup setup)
    : setup_(std::move(setup)),
      layout_(setup_.layout()),
      without_modes_(layout_),
      on_board_(setup_.on_board.layout),
      drift_(layout_.drift_model, layout_.further),
      drift_of_eq1_(kEsg7, layout_.further),
      gyros_(layout_.gyros),
      samples_(&pass.samples),
      fixes_(pass.fixes.size()) {
  for (std::size_t components = 1; components < gates_.size(); ++components) {
    gates_[components] = gate_of_freedom(static_cast<int>(components), setup_.on_board.gate_nis);
  }
  const Time first = pass.fixes.front().fix.t;
  auto fix = pass.fixes.begin();
  Time taken = first;
  const auto add_fixes_until = [&](Time t) {
    for (; fix != pass.fixes.end() && fix->fix.t <= t; ++fix) {
      nodes_.push_back({.t = fix->fix.t, .fix = &*fix});
      taken = fix->fix.t;
    }
  };
  const auto ends_step = [&](std::size_t sample) {  // that the last node begins
    if (sample + 1 == samples_->size()) {
      return true;
    }
    const Time t = samples_->t(sample);
    const Time next = samples_->t(sample + 1);
    if (next - t > setup_.on_board.max_interpolation()) {
      return true;
    }
    if (next - taken <= setup_.sample_step || (fix != pass.fixes.end() && fix->fix.t - t < setup_.sample_step / 2)) {
      return false;
    }
    if (next - taken > setup_.long_step) {
      return true;
    }
    const Reading from = reading_at(nodes_.back());
    const GyroMask used = both(from.used, samples_->used(sample + 1));
    return count(used) < 2 ||
           !turned_less(from.h_b, samples_->h_b(sample + 1), used, gyros_, setup_.turn_in_long_step_rad);
  };
  Time before = first;
  bool after_gap = false;
  for (std::size_t i = samples_->from(first + Duration{1}); i < samples_->size(); ++i) {
    const Time t = samples_->t(i);
    add_fixes_until(t - Duration{1});  // on its own time after it
    after_gap = after_gap || t - before > setup_.on_board.max_interpolation();
    before = t;
    if (after_gap || ends_step(i)) {
      nodes_.push_back({.t = t, .sample = i, .after_gap = std::exchange(after_gap, false)});
      taken = t;
    }
  }
  add_fixes_until(Time::max());
  find_middles();
  // The coefficients are those of the end of the pass; their change is that over the whole pass.
  setup_.on_board.change.zero_at = nodes_.back().t;
  setup_.on_board.change.duration_s = to_seconds(nodes_.back().t - nodes_.front().t);
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (arcs_.empty() || nodes_[i].after_gap || nodes_[i].t - nodes_[arcs_.back().begin].t >= setup_.arc) {
      arcs_.push_back({i, i});
    }
    arcs_.back().end = i + 1;
  }
}

void PassProblem::find_middles() {
  std::size_t sample = 0;
  for (std::size_t i = 1; i < nodes_.size(); ++i) {
    const Time begin = nodes_[i - 1].t;
    const Time middle = begin + (nodes_[i].t - begin) / 2;
    const auto off = [&](std::size_t its) { return std::chrono::abs(samples_->t(its) - middle); };
    while (sample + 1 < samples_->size() && off(sample + 1) <= off(sample)) {
      ++sample;
    }
    if (!nodes_[i].after_gap && samples_->t(sample) > begin && samples_->t(sample) < nodes_[i].t) {
      nodes_[i].middle = sample;
    }
  }
}

Directions PassProblem::mean_reading(Time begin, const Reading& from, const Node& to_node, const Reading& to) const {
  constexpr double kNearMiddle = 0.2;
  const Duration dt = to_node.t - begin;
  const double part =
      to_node.middle ? to_seconds(samples_->t(*to_node.middle) - begin) / to_seconds(dt) : 0;  // of the step before it
  const bool has_middle = std::abs(part - 0.5) < kNearMiddle;
  const Reading middle =
      has_middle ? Reading{samples_->h_b(*to_node.middle), samples_->used(*to_node.middle)} : Reading{};
  Directions mean = unread();
  for (int k = 0; k < gyros_; ++k) {
    if (has_middle && middle.used[k]) {  // the integral of a parabola
      mean[k] = ((0.5 - 1 / (6 * part)) * from.h_b[k] + 1 / (6 * part * (1 - part)) * middle.h_b[k] +
                 (0.5 - 1 / (6 * (1 - part))) * to.h_b[k])
                    .normalized();
    } else {
      mean[k] = (from.h_b[k] + to.h_b[k]).normalized();
    }
  }
  return mean;
}

void PassProblem::for_each_part(const std::function<void(std::size_t, std::size_t)>& work) const {
  for_each_on_all_cores(kParts, [&](std::size_t part) {
    if (end_of(part) < end_of(part + 1)) {
      work(end_of(part), end_of(part + 1));
    }
  });
}

void PassProblem::begin_arc(const PassSolution& solution, std::size_t arc, Moment& moment) const {
  moment.arc = arc;
  moment.t = nodes_[arcs_[arc].begin].t;
  moment.read = reading_at(nodes_[arcs_[arc].begin]);
  moment.gyros = solution.gyros;
  for (int k = 0; k < gyros_; ++k) {
    moment.since[k].begin(drift_.columns());
    Gyro& gyro = moment.gyros[k];
    gyro.h_in = solution.arcs[arc].h_in[k];
    if (layout_.further.wandering_drift) {
      gyro.drift_rad_s.segment<3>(setup_.on_board.layout.wandering_column()) = solution.arcs[arc].wandering_rad_s[k];
    }
    moment.directions[k] = across(gyro.h_in);
  }
}

PassProblem::Reading PassProblem::reading_at(const Node& node) const {
  return node.fix != nullptr ? Reading{node.fix->h_b, node.fix->used}
                             : Reading{samples_->h_b(node.sample), samples_->used(node.sample)};
}

PassProblem::Drift PassProblem::drift_along(const PassSolution& solution, const DriftModel* sensitive) const {
  Drift drift{sensitive, {}};
  for (int k = 0; k < gyros_; ++k) {
    drift.rotors[k] = RotorDrift(drift_, solution.gyros[k].drift_rad_s.data());
  }
  return drift;
}

void PassProblem::step(const Node& to_node, const Drift& drift, Moment& moment, double& extra_variance_rad2) const {
  const Layout& columns = setup_.on_board.layout;
  const Duration dt = to_node.t - moment.t;
  const double dt_s = to_seconds(dt);
  const Reading to = reading_at(to_node);
  const Reading from = std::exchange(moment.read, to);
  Directions middle = mean_reading(moment.t, from, to_node, to);
  DriftTimes times = setup_.on_board.drift_times(moment.t + dt / 2);
  for (DriftTime& time : times) {
    time.part_of_change = setup_.on_board.change.mean_part(moment.t, to_node.t);
  }
  moment.t = to_node.t;
  // Gyros that can be used at both ends; where those are too few, at its end.
  const GyroMask at_both = both(from.used, to.used);
  const GyroMask used = count(at_both) >= 2 ? at_both : to.used;
  for (int k = 0; k < gyros_; ++k) {
    middle[k] = at_both[k] ? middle[k] : used[k] ? to.h_b[k] : Vector3d::UnitX();
  }
  Directions omega_b = {};
  for (int k = 0; k < gyros_; ++k) {
    const Gyro& gyro = moment.gyros[k];
    omega_b[k] = rate_of(drift.rotors[k], gyro, gyro.corrected(middle[k]), times[k], columns);
  }
  // The momenta in the middle of the step; those at its begin would be half a step of drift behind.
  const Directions seen_c = in_c(moment.gyros, gyros_, middle);
  Directions h_middle = momenta(moment.gyros, gyros_);
  if (const auto at_begin = optimal_rotation(h_middle, seen_c, used)) {
    for (int k = 0; k < gyros_; ++k) {
      const Gyro& gyro = moment.gyros[k];
      h_middle[k] = rotated<double>(h_middle[k], at_begin.value().raw() * (gyro.C_c_b * omega_b[k]) * (dt_s / 2));
    }
  }
  const auto attitude = optimal_rotation(h_middle, seen_c, used);
  if (!attitude) {
    extra_variance_rad2 += kUnknown_rad * kUnknown_rad;
    return;
  }
  const Matrix3d C_in_c = attitude.value().raw();
  const bool by_eq1 = drift.sensitive != nullptr && drift.sensitive->columns() == Layout::kEq1;
  if (by_eq1 && gyros_ == 2 && used[0] && used[1] && !to_node.after_gap) {  // nearly all steps of a pair
    precess_two({moment.gyros[0], middle[0]}, {moment.gyros[1], middle[1]}, SensitivityOfEq1(moment.since[0]),
                SensitivityOfEq1(moment.since[1]), C_in_c, dt_s, omega_b[0], omega_b[1]);
    return;
  }
  double largest_rad = 0;
  for (int k = 0; k < gyros_; ++k) {
    Gyro& gyro = moment.gyros[k];
    if (!used[k]) {  // its momentum turns all the same: what it would read at the attitude of the others
      middle[k] = gyro.reading_of(C_in_c.transpose() * gyro.h_in);
      omega_b[k] = rate_of(drift.rotors[k], gyro, gyro.corrected(middle[k]), times[k], columns);
    }
    const Vector3d reading = gyro.corrected(middle[k]);
    const Matrix3d dt_C_in_b = dt_s * (C_in_c * gyro.C_c_b);
    const Vector3d turned = dt_C_in_b * omega_b[k];
    gyro.h_in = rotated<double>(gyro.h_in, turned).normalized();
    if (drift.sensitive != nullptr) {
      Columns<kMaxDriftColumns> basis;
      drift.sensitive->basis(reading, times[k], basis.view(drift.sensitive->columns()));
      moment.since[k].advance(basis.view(drift.sensitive->columns()), C_in_c, dt_C_in_b, turned);
    }
    if (to_node.after_gap) {
      largest_rad = std::max(largest_rad, missed_by_long_step_rad(turned.norm(), from.h_b[k], to.h_b[k], dt_s));
    }
  }
  extra_variance_rad2 += largest_rad * largest_rad;
}

MatrixXd PassProblem::by_states_but_modes(const ByStatesOfArc& momenta, Rows rows) const {
  const Layout& to = without_modes_;
  MatrixXd by_states(rows.rows(), to.size());
  carry_back(on_board_, momenta.since, rows);
  const int moving = to.drift(0) - to.wandering(0);
  by_states.middleCols(to.wandering(0), moving) = rows.middleCols(on_board_.wandering(0), moving);
  for (int k = 0; k < gyros_; ++k) {
    by_states.middleCols<2>(to.direction(k)) =
        rows.middleCols<3>(on_board_.direction(k)).lazyProduct(momenta.directions[k]);
  }
  const int rest = to.size() - to.drift(0);
  by_states.rightCols(rest) = rows.middleCols(on_board_.drift(0), rest);
  return by_states;
}

void PassProblem::put_beside_modes(const MatrixXd& rows, Eigen::Ref<MatrixXd> all) const {
  const Layout& from = without_modes_;
  all.leftCols(layout_.drift(0)) = rows.leftCols(from.drift(0));
  for (int k = 0; k < gyros_; ++k) {
    const int size = from.drift_size();
    all.middleCols(layout_.drift(k), size) = rows.middleCols(from.drift(k), size);
    all.middleCols<3>(layout_.alignment(k)) = rows.middleCols<3>(from.alignment(k));
  }
  const int rest = layout_.size() - layout_.behind_parameters();
  all.rightCols(rest) = rows.rightCols(rest);
}

MatrixXd PassProblem::by_states_of_arc(const Moment& moment, const Rows& rows) const {
  const MatrixXd but_modes = by_states_but_modes(moment, rows);
  if (!modes_) {
    return but_modes;
  }
  MatrixXd by_states(rows.rows(), layout_.size());
  put_beside_modes(but_modes, by_states);
  for (int k = 0; k < gyros_; ++k) {
    by_states.middleCols(layout_.drift(k) + Layout::kEq1, modes_->size()) =
        rows.middleCols<3>(on_board_.direction(k)).lazyProduct(moved_by_modes_.at(moment.arc, moment.t, k));
  }
  return by_states;
}

MatrixXd PassProblem::momentum_by_states(const Moment& moment, int gyro) const {
  Rows rows = Rows::Zero(3, on_board_.size());
  rows.middleCols<3>(on_board_.direction(gyro)).setIdentity();
  return by_states_of_arc(moment, rows);
}

VectorXd PassProblem::as_states(int gyro, const VectorXd& outside) const {
  return modes_ ? VectorXd(modes_->gyros[gyro].amplitudes * outside) : outside;
}

VectorXd PassProblem::as_coefficients(int gyro, const VectorXd& states) const {
  return modes_ ? VectorXd(modes_->gyros[gyro].coefficients * states) : states;
}

MovedByModes PassProblem::moved_by_coefficients(const PassSolution& solution) const {
  constexpr Duration kApart = std::chrono::seconds(10);     // over which the drift turns a momentum evenly
  constexpr Duration kTableStep = std::chrono::seconds(3);  // a third of that, unless the body turns fast
  constexpr double kLittleTurn_rad = 0.01;
  const Drift drift = drift_along(solution, &drift_);
  MovedByModes table(arcs_.size());
  for_each_part([&](std::size_t begin, std::size_t end) {
    Moment moment;
    double unused = 0;
    for (std::size_t arc = begin; arc < end; ++arc) {
      check_stop();
      begin_arc(solution, arc, moment);
      const std::size_t last = std::min(arcs_[arc].end, nodes_.size() - 1);
      Time taken = moment.t - kApart;
      std::size_t from = arcs_[arc].begin;
      for (std::size_t i = from; i <= last; ++i) {
        if (i > from) {
          const Reading next = i < last ? reading_at(nodes_[i + 1]) : Reading{};
          if (i < last && nodes_[i + 1].t - nodes_[from].t <= kTableStep &&
              turned_less(moment.read.h_b, next.h_b, both(moment.read.used, next.used), gyros_, kLittleTurn_rad)) {
            continue;
          }
          step(nodes_[i], drift, moment, unused);
          from = i;
        }
        if (i == last || moment.t - taken >= kApart) {
          taken = moment.t;
          MovedByModes::Columns moved;
          for (int k = 0; k < gyros_; ++k) {
            const auto by_drift = moment.since[k].by_drift.first(drift_.size());
            moved[k] = by_drift.rightCols(drift_.size() - Layout::kEq1).cast<float>();
          }
          table.add(arc, moment.t, std::move(moved));
        }
      }
    }
  });
  return table;
}

void PassProblem::take(DriftModes modes) {
  modes_ = std::move(modes);
  layout_.drift_modes = modes_->size();
  on_board_.drift_model = kEsg7;
  without_modes_ = layout_;
  without_modes_.drift_model = kEsg7;
  without_modes_.drift_modes = -1;
}

void PassProblem::use_modes_of(const PassProblem& other) {
  take(*other.modes_);
  moved_by_modes_ = other.moved_by_modes_;
}

void PassProblem::use(DriftModes modes, const MovedByModes& by_coefficients) {
  take(std::move(modes));
  moved_by_modes_ = MovedByModes(arcs_.size());
  for_each_part([&](std::size_t begin, std::size_t end) {
    for (std::size_t arc = begin; arc < end; ++arc) {
      check_stop();
      const std::size_t size = by_coefficients.size(arc);
      PerGyro<MatrixXd> moved;  // of the whole arc
      for (int k = 0; k < gyros_; ++k) {
        MatrixXd rows(3 * static_cast<Eigen::Index>(size), modes_->gyros[k].coefficients.rows());
        for (std::size_t i = 0; i < size; ++i) {
          rows.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = by_coefficients.added(arc, i, k).cast<double>();
        }
        moved[k] = multiply(rows, modes_->gyros[k].coefficients);
      }
      for (std::size_t i = 0; i < size; ++i) {
        MovedByModes::Columns columns;
        for (int k = 0; k < gyros_; ++k) {
          columns[k] = moved[k].middleRows<3>(3 * static_cast<Eigen::Index>(i)).cast<float>();
        }
        moved_by_modes_.add(arc, by_coefficients.t(arc, i), std::move(columns));
      }
    }
  });
}

PassSolution PassProblem::start(const Gyros& gyros) const {
  PassSolution solution;
  solution.gyros = gyros;
  solution.shared.setZero(layout_.shared_size());
  solution.arcs.resize(arcs_.size());
  const Drift drift = drift_along(solution, nullptr);
  Directions h_in;
  for (int k = 0; k < kMaxGyros; ++k) {
    h_in[k] = k < gyros_ ? Vector3d(gyros[k].C_c_b.col(0)) : Vector3d::UnitX();  // anywhere
  }
  double unused = 0;
  for (std::size_t arc = 0; arc < arcs_.size(); ++arc) {
    check_stop();
    constexpr double kAnyTurn_rad = std::numbers::pi;
    constexpr double kLittle_rad = 1e-3;  // more than any drift, less than an outlier
    follow_first_fix(gyros, arc, arc == 0 ? kAnyTurn_rad : kLittle_rad, h_in);
    PassSolution::Arc& its = solution.arcs[arc];
    its.h_in = h_in;
    for (int k = 0; k < kMaxGyros; ++k) {
      its.wandering_rad_s[k].setZero();
    }
    if (arc + 1 < arcs_.size()) {
      Moment moment;
      begin_arc(solution, arc, moment);
      for (std::size_t i = arcs_[arc].begin; i < arcs_[arc].end; ++i) {
        step(nodes_[i + 1], drift, moment, unused);
      }
      h_in = momenta(moment.gyros, gyros_);
    }
  }
  return solution;
}

void PassProblem::follow_first_fix(const Gyros& gyros, std::size_t arc, double most_rad, Directions& h_in) const {
  const auto begin = nodes_.begin() + static_cast<std::ptrdiff_t>(arcs_[arc].begin);
  const auto end = nodes_.begin() + static_cast<std::ptrdiff_t>(arcs_[arc].end);
  const auto first = std::find_if(begin, end, [](const Node& node) { return node.fix != nullptr; });
  if (first == end) {
    return;
  }
  const Directions h_c = in_c(gyros, gyros_, first->fix->h_b);
  for (int k = 0; k < gyros_; ++k) {
    if (first->fix->used[k]) {
      const Vector3d seen = (first->fix->fix.q_in_c.normalized() * h_c[k]).normalized();
      const Vector3d across = h_in[k].cross(seen);
      const double apart_rad = std::atan2(across.norm(), h_in[k].dot(seen));
      h_in[k] = Eigen::AngleAxisd(std::min(apart_rad, most_rad), across.normalized()) * h_in[k];
    }
  }
}

void PassProblem::go_along(const PassSolution& solution, const std::function<void(const Moment&)>& visit) const {
  const Drift drift = drift_along(solution, &sensitive());
  for (std::size_t arc = 0; arc < arcs_.size(); ++arc) {
    go_along_arc(solution, arc, drift, visit);
  }
}

void PassProblem::go_along_momenta(const PassSolution& solution,
                                   const std::function<void(const Moment&)>& visit) const {
  const Drift drift = drift_along(solution, nullptr);
  for (std::size_t arc = 0; arc < arcs_.size(); ++arc) {
    go_along_arc(solution, arc, drift, visit);
  }
}

PassProblem::Moment PassProblem::last_moment(const PassSolution& solution) const {
  Moment last;
  go_along_arc(solution, arcs_.size() - 1, drift_along(solution, &sensitive()),
               [&](const Moment& moment) { last = moment; });
  return last;
}

void PassProblem::go_along_arc(const PassSolution& solution, std::size_t arc, const Drift& drift,
                               const std::function<void(const Moment&)>& visit) const {
  check_stop();
  Moment moment;
  double unused = 0;
  begin_arc(solution, arc, moment);
  for (std::size_t i = arcs_[arc].begin; i < arcs_[arc].end; ++i) {
    if (i > arcs_[arc].begin) {
      step(nodes_[i], drift, moment, unused);
    }
    moment.fix = nodes_[i].fix;
    visit(moment);
  }
}

Result<AttitudeByDirections, DirectionsFault> PassProblem::attitude(const Moment& moment, const Directions& h_b,
                                                                    const GyroMask& used) const {
  return optimal_attitude(momenta(moment.gyros, gyros_), in_c(moment.gyros, gyros_, h_b), used);
}

MatrixXd PassProblem::attitude_by_states(const Moment& moment, const AttitudeByDirections& attitude,
                                         const Directions& h_b) const {
  return by_states_of_arc(moment, attitude_by_states_now<kPassCapacity.states>(on_board_, attitude, moment.gyros, h_b));
}

PassProblem::Compared PassProblem::compare_now(const PassSolution& solution, const Moment& moment) const {
  const ScreenedPass::Fix& fix = *moment.fix;
  const CalibrationSetup& setup = setup_.on_board;
  const auto by_gyros = optimal_rotation(momenta(moment.gyros, gyros_), in_c(moment.gyros, gyros_, fix.h_b), fix.used);
  if (!by_gyros) {
    return {};
  }
  const FixBySharedStates by_shared = fix_by_shared_states(setup, fix.fix, fix.rate_c);
  const Rot<In, C> C_fix = corrected(fix.fix, by_shared.lazyProduct(solution.shared));
  // Linearised at the attitude by the gyros, which has no noise of the fix.
  const FixComparison comparison =
      trihedron::compare(on_board_, moment.gyros, C_fix.raw(), by_gyros.value().raw(), fix.h_b, fix.used, by_shared);
  const auto noise = [&](double sharing) {
    PerGyro<double> noise_rad;
    for (int k = 0; k < gyros_; ++k) {
      noise_rad[k] = setup.readout_noise_rad[k] * fix.noise_factor * std::sqrt(sharing);
    }
    Eigen::Matrix3d R_c = fix_noise(setup, fix.fix);
    R_c.diagonal().array() += static_cast<double>(fix.jitter_rad2);
    return noise_of(comparison, R_c, noise_rad);
  };
  const double sharing = setup.fixes_sharing_a_sample(fix.since_last);
  Compared compared{rows_about_states_now<kPassCapacity.states>(on_board_, comparison), noise(sharing), {}};
  if (sharing > 1) {
    compared.R_alone = noise(1);
  }
  return compared;
}

double PassProblem::whiten_rows(Compared& fix) const {
  const Index last = on_board_.size();
  const double alone = fix.R_alone ? nis_of(fix.rows.col(last), *fix.R_alone) : 0;
  whiten(fix.R, rows_of(fix.rows));
  return fix.R_alone ? alone : fix.rows.col(last).squaredNorm();
}

PassProblem::FixRows PassProblem::compare(const PassSolution& solution, const Moment& moment) const {
  const Compared compared = compare_now(solution, moment);
  FixRows rows;
  if (compared.rows.rows() == 0) {
    rows.H.setZero(0, layout_.size());
    return rows;
  }
  rows.y = compared.rows.col(on_board_.size());
  rows.H = by_states_of_arc(moment, compared.rows.leftCols(on_board_.size()));
  rows.R = compared.R;
  rows.R_alone = compared.R_alone.value_or(compared.R);
  return rows;
}

MatrixXd PassProblem::rows_about_alignments(const PassSolution& solution, const Moment& moment) const {
  Compared fix = compare_now(solution, moment);
  const Index count = fix.rows.rows();
  if (count == 0 || whiten_rows(fix) > gate_of(count)) {
    return {};
  }
  MatrixXd rows(count, 3L * gyros_ + 1);
  for (int k = 0; k < gyros_; ++k) {
    rows.middleCols<3>(3L * k) = fix.rows.middleCols<3>(on_board_.alignment(k));
  }
  rows.rightCols<1>() = fix.rows.col(on_board_.size());
  return rows;
}

bool PassProblem::is_outlier(const FixRows& rows) const {
  return nis_of(rows.y, rows.R_alone) > gate_of(rows.y.size());
}

MatrixXd PassProblem::prior_covariance() const {
  if (!modes_) {
    return setup_.prior.covariance;
  }
  PerGyro<MatrixXd> amplitudes;
  for (int k = 0; k < gyros_; ++k) {
    amplitudes[k] = modes_->gyros[k].amplitudes;
  }
  const MatrixXd& given = setup_.prior.covariance;
  const MatrixXd of_parameters = parameters_by_parameters(layout_, setup_.layout(), amplitudes);
  const Index beside = given.cols() - of_parameters.cols();  // amplitudes of drift that comes back
  MatrixXd map = MatrixXd::Zero(of_parameters.rows() + beside, given.cols());
  map.topLeftCorner(of_parameters.rows(), of_parameters.cols()) = of_parameters;
  map.bottomRightCorner(beside, beside).setIdentity();
  return multiply(multiply(map, given), map.transpose());
}

void PassProblem::add_prior(const PassSolution& solution, Linear& linear) const {
  const CalibrationSetup& setup = setup_.on_board;
  const int fewer = setup.layout.behind_parameters() - layout_.behind_parameters();
  VectorXd sigma = VectorXd::Constant(layout_.size(), kUnknown_rad);
  for (int state = layout_.behind_parameters(); state < layout_.size(); ++state) {
    sigma(state) = prior_sigma_of_further_state(setup, state + fewer);
  }
  VectorXd apart = VectorXd::Zero(layout_.size());  // prior mean − solution
  for (int k = 0; k < gyros_; ++k) {
    const Gyro& prior = setup_.prior.gyros[k];
    const Gyro& gyro = solution.gyros[k];
    const Gyro::Coefficients drift = prior.drift_rad_s - gyro.drift_rad_s;
    apart.segment<Layout::kEq1>(layout_.drift(k)) = drift.head<Layout::kEq1>();
    apart.segment(layout_.drift(k) + Layout::kEq1, layout_.drift_size() - Layout::kEq1) =
        as_states(k, drift.segment(Layout::kEq1, setup.layout.drift_size() - Layout::kEq1));
    apart.segment<3>(layout_.alignment(k)) =
        Rot<C, C>::assume(Matrix3d(prior.C_c_b * gyro.C_c_b.transpose())).log().raw();
    apart.segment(layout_.readout(k), layout_.readout_size()) = prior.errors(layout_) - gyro.errors(layout_);
    const auto its_columns = setup.layout.beside_kappa(k);
    const auto its_states = layout_.beside_kappa(k);
    for (std::size_t i = 0; i < its_states.size(); ++i) {
      apart.segment(its_states[i].state, its_states[i].size) = drift.segment(its_columns[i].column, its_states[i].size);
    }
  }
  apart.tail(solution.shared.size()) = -solution.shared;
  linear.prior = sigma.cwiseInverse().asDiagonal();
  // Nothing is known before of the directions at the start, where the first fix shows them.
  for (int k = 0; k < gyros_; ++k) {
    if (nodes_.front().fix->used[k]) {
      linear.prior.middleRows<2>(layout_.direction(k)).setZero();
    }
  }
  MatrixXd root = prior_covariance();
  const Index size = root.rows();
  if (!to_root(root)) {
    root.setConstant(std::nan(""));  // which smooth() refuses
  }
  MatrixXd inverse = MatrixXd::Identity(size, size);
  solve_lower(root, inverse);
  linear.prior.block(layout_.drift(0), layout_.drift(0), size, size) = inverse;
  linear.prior_y = linear.prior * apart;
}

void PassProblem::end_arc(const PassSolution& solution, const Moment& moment, double extra_variance_rad2,
                          Linear& linear) const {
  const int d = layout_.dynamic();
  SmootherStage& stage = linear.stages[moment.arc];
  Linear::ArcEnd& end = linear.ends[moment.arc];
  end.duration_s = to_seconds(moment.t - nodes_[arcs_[moment.arc].begin].t);
  end.extra_variance_rad2 = extra_variance_rad2;
  stage.m.setZero(d);
  const PassSolution::Arc& next = solution.arcs[moment.arc + 1];
  Rows rows = Rows::Zero(2L * gyros_, on_board_.size());
  for (int k = 0; k < gyros_; ++k) {
    const Eigen::Matrix<double, 2, 3> T = across(next.h_in[k]).transpose();
    const int row = layout_.direction(k);
    rows.block<2, 3>(row, on_board_.direction(k)) = T;
    stage.m.segment<2>(row) = T * turn(next.h_in[k], moment.gyros[k].h_in);
  }
  const MatrixXd by_states = by_states_of_arc(moment, rows);
  end.A.setZero(d, d);
  end.A.topRows(2L * gyros_) = by_states.leftCols(d);
  stage.B.setZero(d, layout_.constants());
  stage.B.topRows(2L * gyros_) = by_states.rightCols(layout_.constants());
}

void PassProblem::put_noise(const PassSolution& solution, const ProcessNoise& noise, MatrixXd& prior,
                            VectorXd& prior_y) const {
  for (int k = 0; layout_.further.wandering_drift && k < gyros_; ++k) {
    const int row = layout_.wandering(k);
    prior.block<3, 3>(row, row) = 1 / noise.wandering_drift.sigma * Matrix3d::Identity();
    prior_y.segment<3>(row) = -solution.arcs[0].wandering_rad_s[k] / noise.wandering_drift.sigma;
  }
}

void PassProblem::put_noise(const PassSolution& solution, const ProcessNoise& noise, std::size_t arc,
                            const Linear::ArcEnd& end, SmootherStage& stage) const {
  const double walk = noise.direction_random_walk_rad_sqrt_s;
  const double kept = noise.wandering_drift.kept(end.duration_s);
  stage.noise.setZero(layout_.dynamic());
  stage.noise.head(2L * gyros_).setConstant(std::sqrt(walk * walk * end.duration_s + end.extra_variance_rad2));
  MatrixXd A = end.A;
  for (int k = 0; layout_.further.wandering_drift && k < gyros_; ++k) {
    const int row = layout_.wandering(k);
    A.block<3, 3>(row, row) = kept * Matrix3d::Identity();
    stage.m.segment<3>(row) = kept * solution.arcs[arc].wandering_rad_s[k] - solution.arcs[arc + 1].wandering_rad_s[k];
    stage.noise.segment<3>(row).setConstant(noise.wandering_drift.noise(kept));
  }
  stage.A_inverse = A.inverse();
}

SmootherStage PassProblem::stage(const PassSolution& solution, const Linear& linear, std::size_t arc,
                                 const ProcessNoise& noise) const {
  SmootherStage stage = linear.stages[arc];
  if (arc < linear.ends.size()) {
    put_noise(solution, noise, arc, linear.ends[arc], stage);
  }
  return stage;
}

double PassProblem::scale_of_misfits(const PassSolution& solution) const {
  constexpr double kMedianOfFour = 0.84;  // of χ²/n; nearer to 1 for more
  constexpr std::size_t kEnough = 100;
  const std::size_t of_one_arc = 1 + kEnough / arcs_.size();
  std::vector<std::vector<double>> of_arcs(arcs_.size());
  const Drift drift = drift_along(solution, nullptr);
  for_each_part([&](std::size_t begin, std::size_t end) {
    Moment moment;
    double unused = 0;
    for (std::size_t arc = begin; arc < end; ++arc) {
      check_stop();
      begin_arc(solution, arc, moment);
      std::size_t left = of_one_arc;
      for (std::size_t i = arcs_[arc].begin; i < arcs_[arc].end && left > 0; ++i) {
        if (i > arcs_[arc].begin) {
          step(nodes_[i], drift, moment, unused);
        }
        moment.fix = nodes_[i].fix;
        Compared fix = moment.fix != nullptr ? compare_now(solution, moment) : Compared{};
        if (const Eigen::Index components = fix.rows.rows(); components > 0) {
          of_arcs[arc].push_back(whiten_rows(fix) / static_cast<double>(components));
          --left;
        }
      }
    }
  });
  std::vector<double> nis_per_component;
  for (const std::vector<double>& its : of_arcs) {
    nis_per_component.insert(nis_per_component.end(), its.begin(), its.end());
  }
  if (nis_per_component.empty()) {
    return 1;
  }
  return std::max(median_of(nis_per_component) / kMedianOfFour, 1.0);
}

PassProblem::Linear PassProblem::linearise(const PassSolution& solution) const { return linearise(solution, false); }

PassProblem::Linear PassProblem::linearise_by_parts(const PassSolution& solution) const {
  return linearise(solution, true);
}

PassProblem::Linear PassProblem::linearise(const PassSolution& solution, bool by_parts) const {
  // Far from the solution all fixes have large misfits: outliers are those far above the median.
  const double scale = scale_of_misfits(solution);
  Linear linear;
  linear.stages.resize(arcs_.size());
  linear.ends.resize(arcs_.size() - 1);
  const Drift drift = drift_along(solution, &sensitive());
  std::vector<double> outside_rows(arcs_.size());
  for_each_part([&](std::size_t begin, std::size_t end) {
    ConstantSquares constants(by_parts ? layout_.constants() + 1 : 0);
    Moment moment;
    FixMerger nearby(*this);
    for (std::size_t arc = begin; arc < end; ++arc) {
      double extra_variance_rad2 = 0;
      nearby.clear();
      outside_rows[arc] = add_arc(solution, arc, drift, scale, moment, extra_variance_rad2, nearby);
      SmootherStage& stage = linear.stages[arc];
      outside_rows[arc] += nearby.put_into(arc, stage);
      if (!by_parts) {
        compress(stage);
      } else {
        take_constants(stage, layout_.dynamic(), constants);
        if (arc + 1 == end) {
          put_back(constants, layout_.dynamic(), stage);
        }
      }
      if (arc + 1 < arcs_.size()) {
        end_arc(solution, moment, extra_variance_rad2, linear);
      } else {
        stage.m.setZero(layout_.dynamic());
      }
    }
  });
  linear.cost_outside_rows = std::accumulate(outside_rows.begin(), outside_rows.end(), 0.0);
  renew(solution, linear);
  return linear;
}

void PassProblem::renew(const PassSolution& solution, Linear& linear) const {
  add_prior(solution, linear);
  put_noise(solution, setup_.noise(), linear.prior, linear.prior_y);
  for (std::size_t arc = 0; arc < linear.ends.size(); ++arc) {
    put_noise(solution, setup_.noise(), arc, linear.ends[arc], linear.stages[arc]);
  }
}

double PassProblem::add_arc(const PassSolution& solution, std::size_t arc, const Drift& drift, double scale,
                            Moment& moment, double& extra_variance_rad2, FixMerger& nearby) const {
  check_stop();
  begin_arc(solution, arc, moment);
  double cost = 0;
  for (std::size_t i = arcs_[arc].begin; i < arcs_[arc].end; ++i) {
    moment.fix = nodes_[i].fix;
    if (moment.fix != nullptr) {
      cost += add_fix(compare_now(solution, moment), moment, scale, nearby);
    }
    if (i + 1 < nodes_.size()) {
      step(nodes_[i + 1], drift, moment, extra_variance_rad2);
    }
  }
  return cost;
}

void PassProblem::for_each_arc(const PassSolution& solution, const std::vector<std::size_t>& begins,
                               const Beside& beside,
                               const std::function<void(std::size_t, std::size_t, const MatrixXd&)>& use) const {
  const double scale = scale_of_misfits(solution);
  const Drift drift = drift_along(solution, &sensitive());
  for_each_on_all_cores(begins.size() - 1, [&](std::size_t part) {
    Moment moment;
    SmootherStage stage;
    FixMerger nearby(*this, beside);
    for (std::size_t arc = begins[part]; arc < begins[part + 1]; ++arc) {
      double unused = 0;
      nearby.clear();
      static_cast<void>(add_arc(solution, arc, drift, scale, moment, unused, nearby));
      static_cast<void>(nearby.put_into(arc, stage));
      const MatrixXd columns = nearby.beside();
      MatrixXd rows(stage.H.rows(), stage.H.cols() + columns.cols() + 1);
      rows << stage.H, columns, stage.y;
      use(part, arc, rows);
    }
  });
}

double PassProblem::add_fix(Compared fix, const Moment& moment, double scale, FixMerger& nearby) const {
  if (fix.rows.rows() == 0) {
    return 0;
  }
  const double gate = scale * gate_of(fix.rows.rows());
  const double nis = whiten_rows(fix);
  nearby.add(moment, fix.rows, nis > gate ? gate / nis : 1);
  return nis > gate ? 2 * gate * (1 - gate / nis) : 0;
}

void PassProblem::correct(const SmootherResult& found, PassSolution& solution) const {
  for (std::size_t arc = 0; arc < arcs_.size(); ++arc) {
    const VectorXd& x = found.x[arc];
    PassSolution::Arc& its = solution.arcs[arc];
    for (int k = 0; k < gyros_; ++k) {
      its.h_in[k] = rotated<double>(its.h_in[k], across(its.h_in[k]) * x.segment<2>(layout_.direction(k))).normalized();
      if (layout_.further.wandering_drift) {
        its.wandering_rad_s[k] += x.segment<3>(layout_.wandering(k));
      }
    }
  }
  const VectorXd& x = found.x.back();
  // As errors of the states on board.
  const Layout& on_board = setup_.on_board.layout;
  VectorXd errors = VectorXd::Zero(on_board.size());
  const int rest = layout_.size() - layout_.behind_parameters();
  errors.tail(rest) = x.tail(rest);
  for (int k = 0; k < gyros_; ++k) {
    errors.segment<Layout::kEq1>(on_board.drift(k)) = x.segment<Layout::kEq1>(layout_.drift(k));
    errors.segment(on_board.drift(k) + Layout::kEq1, on_board.drift_size() - Layout::kEq1) =
        as_coefficients(k, x.segment(layout_.drift(k) + Layout::kEq1, layout_.drift_size() - Layout::kEq1));
    errors.segment<3>(on_board.alignment(k)) = x.segment<3>(layout_.alignment(k));
    add_parameter_errors(on_board, k, errors, solution.gyros[k]);
  }
  solution.shared += x.tail(solution.shared.size());
}

}  // namespace trihedron::ground
