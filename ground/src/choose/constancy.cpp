#include "choose/constancy.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "choose/jumps.hpp"
#include "linear/gram.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/records/stop.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Coefficients of eq. (1) and the alignment of one gyro.
constexpr Index kOfGyro = Layout::kEq1 + 3;
constexpr int kOfAberration = 9;
constexpr int kOfReadout = 6;
/// Sine and cosine about the three axes of a star tracker, for each multiple of the orbital rate from 2 on.
constexpr int kOfMultiple = 6;
constexpr int kMultiplesOfRate = 2;
constexpr int kBeforeReadout = kOfAberration + kMultiplesOfRate * kOfMultiple;
/// Sine and cosine about the three axes of the body by which a gyro's case goes to and fro at the orbital rate.
constexpr int kOfCase = 6;
/// Errors of the readings of a gyro as functions of the direction: fields on the sphere up to this degree.
constexpr DriftModelId kFields = vsh(4);
constexpr int kOfShapesOfGyro = kOfReadout + kOfCase + kFields.size();

/// Columns of the shapes of one jump: rotations of all cases, of each, steps of each momentum, rotations of the
/// inertial axes.
struct ColumnsOfJump {
  int gyros;

  static constexpr Index kAllCases = 0;
  [[nodiscard]] static Index case_of(int gyro) { return 3 + 3L * gyro; }
  [[nodiscard]] Index momentum(int gyro) const { return 3 + 3L * gyros + 2L * gyro; }
  [[nodiscard]] Index axes() const { return 3 + 5L * gyros; }
  [[nodiscard]] Index size() const { return 6 + 5L * gyros; }
};

/// A stretch of the pass as a sum of squares, a form zᵀ Q z of the states that move at its beginning and at its end, of
/// constants, of shapes of errors of the fixes, and of 1. What moves at the beginning counts as constant in it.
class Stretch {
 public:
  Stretch(Index moving, Index constants, Index shapes) : d_(moving), rest_(constants + shapes) {}

  /// Rows about the states of the arc that it has come to, constants, shapes, and what they are compared with; unit
  /// noise.
  void measure(const MatrixXd& rows) {
    if (rows.rows() == 0) {
      return;
    }
    MatrixXd its = MatrixXd::Zero(rows.rows(), 2 * d_ + rest_);
    its.middleCols(stages_.empty() ? d_ : 0, d_) = rows.leftCols(d_);
    its.rightCols(rest_) = rows.middleCols(d_, rest_);
    if (stages_.empty()) {
      add_to_prior(its, rows.rightCols(1));
    } else {
      stages_.back().H = std::move(its);
      stages_.back().y = rows.rightCols(1);
    }
  }

  /// Goes on to the beginning of the next arc. `by_shapes`: of its states, by those shapes of which a part happens in
  /// this one, the last of all.
  void move(const SmootherStage& its, const MatrixXd& by_shapes) {
    constexpr double kLeastNoise_rad = 1e-9;  // 0.2 mas: no reading shows it
    LongRows B = LongRows::Zero(d_, d_ + rest_);
    B.middleCols(d_, its.B.cols()) = its.B;
    B.rightCols(by_shapes.cols()) = by_shapes;
    if (stages_.empty()) {  // w = (d' − A d − B c − m) / noise
      MatrixXd rows(d_, 2 * d_ + rest_);
      rows << MatrixXd::Identity(d_, d_), -its.A_inverse.inverse(), -B.rightCols(rest_);
      const VectorXd weight = its.noise.cwiseMax(kLeastNoise_rad).cwiseInverse();
      add_to_prior(weight.asDiagonal() * rows, weight.cwiseProduct(its.m));
    } else {
      SmootherStage& stage = stages_.back();
      stage.A_inverse = its.A_inverse;
      stage.B = std::move(B);
      stage.m = its.m;
      stage.noise = its.noise;
    }
    SmootherStage& next = stages_.emplace_back();
    next.H.setZero(0, 2 * d_ + rest_);
    next.m.setZero(d_);
  }

  /// `is_last`: of the states at its end nothing more will be known, and they are eliminated.
  [[nodiscard]] MatrixXd form(bool is_last) {
    const ConstantsInformation found =
        eliminate_moving(prior_, prior_y_, stages_.size(), [this](std::size_t i) { return std::move(stages_[i]); });
    MatrixXd form = MatrixXd::Zero(2 * d_ + rest_ + 1, 2 * d_ + rest_ + 1);
    const MatrixXd squares = found.squares.selfadjointView<Eigen::Lower>();
    form.topLeftCorner(d_, d_) = squares.topLeftCorner(d_, d_);
    form.topRightCorner(d_, rest_ + 1) = squares.topRightCorner(d_, rest_ + 1);
    form.bottomLeftCorner(rest_ + 1, d_) = squares.bottomLeftCorner(rest_ + 1, d_);
    form.bottomRightCorner(rest_ + 1, rest_ + 1) = squares.bottomRightCorner(rest_ + 1, rest_ + 1);
    if (!is_last) {
      MatrixXd rows(d_, form.cols());
      rows << found.moving.middleCols(d_, d_), found.moving.leftCols(d_), found.moving.rightCols(rest_ + 1);
      form.noalias() += rows.transpose() * rows;
    }
    form.rightCols(1) *= -1;
    form.bottomRows(1) *= -1;
    return form;
  }

 private:
  void add_to_prior(const MatrixXd& rows, const VectorXd& y) {
    const Index before = prior_.rows();
    prior_.conservativeResize(before + rows.rows(), rows.cols());
    prior_.bottomRows(rows.rows()) = rows;
    prior_y_.conservativeResize(prior_.rows());
    prior_y_.tail(rows.rows()) = y;
  }

  Index d_;
  Index rest_;
  MatrixXd prior_;  ///< of its second arc: all of the first, and how the pass goes on from there
  VectorXd prior_y_;
  std::vector<SmootherStage> stages_;  ///< from the second arc on
};

/// Removes the first variables of a form, to their likeliest values. `follow`: how these follow the others, negated.
MatrixXd without_first(const MatrixXd& form, Index size, MatrixXd* follow = nullptr) {
  const Index rest = form.rows() - size;
  MatrixXd root = form.topLeftCorner(size, size);
  static_cast<void>(to_root(root));  // positive definite, since the pass has a solution
  MatrixXd half = form.topRightCorner(size, rest);
  solve_lower(root, half);
  if (follow != nullptr) {
    *follow = root.triangularView<Eigen::Lower>().transpose().solve(half);
  }
  MatrixXd left = form.bottomRightCorner(rest, rest);
  add_gram(half.transpose(), -1, left);
  return left.selfadjointView<Eigen::Lower>();
}

Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Adds the shapes of aberration to those of a fix: by a velocity that is constant, and by two at orbital period, over
/// the speed of light, in axes.
void add_aberration(const PassProblem::Moment& moment, double phase, const MatrixXd& rows, const Layout& layout,
                    Eigen::Ref<MatrixXd> shapes) {
  const Matrix3d aberrated =
      cross(Vector3d::UnitZ()) * moment.fix->fix.q_in_c.normalized().toRotationMatrix().transpose();
  for (int k = 0; k < layout.gyros; ++k) {
    const Eigen::Matrix<double, Eigen::Dynamic, 3> by_velocity =
        rows.middleCols<3>(layout.alignment(k)).lazyProduct(aberrated);
    shapes.middleCols<3>(0) += by_velocity;
    shapes.middleCols<3>(3) += std::cos(phase) * by_velocity;
    shapes.middleCols<3>(6) += std::sin(phase) * by_velocity;
  }
}

/// What may be expected of these, 1-sigma: the Earth's orbital velocity over that of light, and a spacecraft's.
VectorXd sigmas_of_aberration() {
  constexpr double kAnnual = 6e-5;
  constexpr double kOrbital = 1.5e-5;
  VectorXd sigmas = VectorXd::Constant(kOfAberration, kOrbital);
  sigmas.head<3>().setConstant(kAnnual);
  return sigmas;
}

/// An error of the star tracker at an angle's sine and cosine, six columns about c x, y, z: as alignments of all gyros.
void add_error_at(double angle, const MatrixXd& rows, const Layout& layout, Eigen::Ref<MatrixXd> error) {
  for (int k = 0; k < layout.gyros; ++k) {
    const auto by_alignment = rows.middleCols<3>(layout.alignment(k));
    error.leftCols<3>() += std::sin(angle) * by_alignment;
    error.rightCols<3>() += std::cos(angle) * by_alignment;
  }
}

/// Shapes of errors of a fix, columns beside its rows: aberration by a velocity that is constant, and by two at orbital
/// period, over the speed of light, in axes; rotations of the star tracker that go to and fro at multiples of the
/// orbital rate; gyro by gyro what the scales of the direction cosines are off 1, and the angles between their axes off
/// right angles, then rotations of the case that go to and fro at the orbital rate, then fields of the readings
/// (kFields). Each moves the directions as a small rotation of the cases would, an alignment. Then `more` columns of
/// zero.
MatrixXd shapes_of(const CalibrationSetup& setup, const DriftModel& model_of_fields, const PassProblem::Moment& moment,
                   const Layout& layout, const MatrixXd& rows, Index more) {
  MatrixXd shapes = MatrixXd::Zero(rows.rows(), kBeforeReadout + Index{kOfShapesOfGyro} * layout.gyros + more);
  const double phase = setup.orbital_rate_rad_s * to_seconds(moment.t - setup.orbital_phase_zero);
  if (moment.fix->fix.head == 0) {
    add_aberration(moment, phase, rows, layout, shapes.leftCols<kOfAberration>());
    for (int i = 0; i < kMultiplesOfRate; ++i) {
      add_error_at((i + 2) * phase, rows, layout,
                   shapes.middleCols<kOfMultiple>(kOfAberration + Index{kOfMultiple} * i));
    }
  }
  for (int k = 0; k < layout.gyros; ++k) {
    const auto by_alignment = rows.middleCols<3>(layout.alignment(k));
    const Matrix3d& C_c_b = moment.gyros[k].C_c_b;
    const Vector3d& h_b = moment.fix->h_b[k];
    Eigen::Matrix<double, 3, kOfReadout> read;   // what a reading is off by
    read << h_b.x(), 0, 0, h_b.y(), 0, h_b.z(),  //
        0, h_b.y(), 0, h_b.x(), h_b.z(), 0,      //
        0, 0, h_b.z(), 0, h_b.y(), h_b.x();
    const Matrix3d turned_by_reading = cross(-(C_c_b * h_b)) * C_c_b;
    const Eigen::Matrix<double, 3, kOfReadout> by_readout = turned_by_reading * read;
    const Index own = kBeforeReadout + Index{kOfShapesOfGyro} * k;
    Columns<kFields.size()> fields;
    model_of_fields.basis(h_b, {}, fields.view(kFields.size()));
    const Eigen::Matrix<double, 3, kFields.size()> by_fields = turned_by_reading * fields.first(kFields.size());
    shapes.middleCols<kFields.size()>(own + kOfReadout + kOfCase) = by_alignment.lazyProduct(by_fields);
    shapes.middleCols<3>(own + kOfReadout) = std::sin(phase) * by_alignment;
    shapes.middleCols<3>(own + kOfReadout + 3) = std::cos(phase) * by_alignment;
    shapes.middleCols<kOfReadout>(own) = by_alignment.lazyProduct(by_readout);
  }
  return shapes;
}

/// How far drift of 1 rad/s about each axis of the body, times sine and cosine of the orbital phase, has turned a
/// momentum, in axes.
class TurnedByOrbitalDrift {
 public:
  TurnedByOrbitalDrift(double rate_rad_s, Time phase_zero) : rate_rad_s_(rate_rad_s), phase_zero_(phase_zero) {}

  /// To a later time. Between them the body turns evenly.
  void go_to(Time t, const Eigen::Quaterniond& q_in_c) {
    constexpr double kStep_s = 5;
    if (last_) {
      const double span_s = to_seconds(t - *last_);
      const auto steps = static_cast<int>(std::ceil(span_s / kStep_s));
      for (int i = 0; i < steps; ++i) {
        const double part = (i + 0.5) / steps;
        const Matrix3d by_time = span_s / steps * last_q_.slerp(part, q_in_c).toRotationMatrix();
        const double phase = rate_rad_s_ * (to_seconds(*last_ - phase_zero_) + part * span_s);
        turned_.leftCols<3>() += std::sin(phase) * by_time;
        turned_.rightCols<3>() += std::cos(phase) * by_time;
      }
    }
    last_ = t;
    last_q_ = q_in_c;
  }
  [[nodiscard]] const Eigen::Matrix<double, 3, 6>& turned_in() const { return turned_; }

 private:
  double rate_rad_s_;
  Time phase_zero_;
  std::optional<Time> last_;
  Eigen::Quaterniond last_q_ = Eigen::Quaterniond::Identity();
  Eigen::Matrix<double, 3, 6> turned_ = Eigen::Matrix<double, 3, 6>::Zero();
};

/// Root mean square over the sphere of each member of the fields whose amplitude is 1; infinite for rotations, which
/// the alignment has.
VectorXd rms_of_fields() {
  const DriftModel model(kFields, {});
  VectorXd rms(kFields.size());
  for (int i = 0; i < kFields.size(); ++i) {
    const DriftCoefficient& member = model.member(i);
    constexpr double kOfEq1 = 0.23;  // of k0 0.195, of the others 0.239
    const bool is_rotation = member.member == DriftCoefficient::Member::kD && member.degree == 1;
    rms(i) = is_rotation          ? std::numeric_limits<double>::infinity()
             : member.is_in_eq1() ? kOfEq1
                                  : std::sqrt(member.degree * (member.degree + 1) / (4 * std::numbers::pi));
  }
  return rms;
}

MatrixXd prior_rows(const PassProblem::Linear& linear, Index shapes) {
  MatrixXd rows(linear.prior.rows(), linear.prior.cols() + shapes + 1);
  rows << linear.prior, MatrixXd::Zero(linear.prior.rows(), shapes), linear.prior_y;
  return rows;
}

/// The form of a last stretch, which has none of the states at its end, without their place.
MatrixXd without_states_at_end(const MatrixXd& form, Index states) {
  std::vector<Index> others;
  for (Index i = 0; i < form.rows(); ++i) {
    if (i < states || i >= 2 * states) {
      others.push_back(i);
    }
  }
  return form(others, others);
}

/// The whole pass as a form of what may move, all else eliminated. The pass is cut into stretches; the variables are
/// the steps of the parameters at the beginning of each stretch but the first, those of the momenta, the shapes, 1.
class Constancy {
 public:
  /// `found`: converged, so that its rows are about what is most likely.
  Constancy(const PassProblem& problem, const BatchResult& found, const std::vector<Jump>& jumps)
      : problem_(problem), layout_(problem_.layout()), jump_{layout_.gyros} {
    const PassProblem::Linear& linear = found.linear;
    for (std::size_t i = 0; i <= stretches(problem_.arcs()); ++i) {
      begins_.push_back(i * problem_.arcs() / stretches(problem_.arcs()));
    }
    const auto count = static_cast<Index>(begins_.size()) - 1;
    const Index d = layout_.dynamic();
    const Index n = layout_.size();
    const Index lasting = kBeforeReadout + Index{kOfShapesOfGyro} * layout_.gyros;
    const Index of_jumps = static_cast<Index>(jumps.size()) * jump_.size();
    const Index shapes = lasting + of_jumps;
    std::vector<Index> parameters;
    std::vector<Index> others;
    for (Index c = d; c < n; ++c) {
      bool own = false;
      for (int k = 0; k < layout_.gyros; ++k) {
        own = own || (c >= layout_.drift(k) && c < layout_.drift(k) + Layout::kEq1) ||
              (c >= layout_.alignment(k) && c < layout_.alignment(k) + 3);
      }
      (own ? parameters : others).push_back(c);
    }
    // Variables: the states that move at the beginnings; the other constants; parameters and steps of the momenta
    // stretch by stretch; shapes; 1.
    const Index at_others = count * d;
    const Index at_steps = at_others + static_cast<Index>(others.size());
    const Index at_shapes = at_steps + count * of_stretch();
    const Index size = at_shapes + shapes + 1;
    MatrixXd whole = MatrixXd::Zero(size, size);
    const auto add_stretch = [&](Index i, const MatrixXd& form) {
      std::vector<Index> place(static_cast<std::size_t>(2 * d + n - d + shapes + 1));
      for (Index j = 0; j < d; ++j) {
        place[static_cast<std::size_t>(j)] = i * d + j;
        place[static_cast<std::size_t>(d + j)] = std::min(i + 1, count - 1) * d + j;  // of the last zeros
      }
      const auto constant = [&](Index c) -> Index& { return place[static_cast<std::size_t>(d + c)]; };
      for (std::size_t j = 0; j < others.size(); ++j) {
        constant(others[j]) = at_others + static_cast<Index>(j);
      }
      for (std::size_t j = 0; j < parameters.size(); ++j) {
        constant(parameters[j]) = at_steps + i * of_stretch() + static_cast<Index>(j);
      }
      for (Index j = 0; j <= shapes; ++j) {
        constant(n + j) = at_shapes + j;
      }
      whole(place, place) += form;
      if (i + 1 < count) {  // the states at its end are those of the next beginning less the step there
        const Index step = at_steps + (i + 1) * of_stretch() + kOfGyro * layout_.gyros;
        const Index directions = 2L * layout_.gyros;
        for (Index j = 0; j < directions; ++j) {
          for (std::size_t row = 0; row < place.size(); ++row) {
            const double value = form(d + j, static_cast<Index>(row));
            whole(step + j, place[row]) -= value;
            whole(place[row], step + j) -= value;
          }
        }
        whole.block(step, step, directions, directions) += form.block(d, d, directions, directions);
      }
    };
    Stretch stretch(d, n - d, shapes);
    stretch.measure(prior_rows(linear, shapes));
    Index at_stretch = 0;
    const auto momentum_by_axes = [&](std::size_t arc, int gyro) -> Eigen::Matrix<double, 2, 3> {
      return across(found.before.arcs[arc].h_in[gyro]).transpose();
    };
    const auto is_in = [&](const Jump& jump, std::size_t arc) {
      return problem_.begin_of(arc) <= jump.after &&
             (arc + 1 == problem_.arcs() || jump.after < problem_.begin_of(arc + 1));
    };
    const DriftModel model_of_fields(kFields, {});
    const auto beside = [&](const PassProblem::Moment& moment, const Layout& layout, const MatrixXd& rows) {
      MatrixXd columns = shapes_of(problem_.setup().on_board, model_of_fields, moment, layout, rows, of_jumps);
      for (std::size_t j = 0; j < jumps.size(); ++j) {
        if (moment.t < jumps[j].after) {
          continue;
        }
        auto own = columns.middleCols(lasting + static_cast<Index>(j) * jump_.size(), jump_.size());
        for (int k = 0; k < layout.gyros; ++k) {
          const auto by_alignment = rows.middleCols<3>(layout.alignment(k));
          own.middleCols<3>(ColumnsOfJump::kAllCases) += by_alignment;
          own.middleCols<3>(ColumnsOfJump::case_of(k)) = by_alignment;
          if (is_in(jumps[j], moment.arc)) {
            const Eigen::Matrix<double, Eigen::Dynamic, 2> by_momentum = rows.middleCols<2>(layout.direction(k));
            own.middleCols<2>(jump_.momentum(k)) = by_momentum;
            own.middleCols<3>(jump_.axes()) += by_momentum.lazyProduct(momentum_by_axes(moment.arc, k));
          }
        }
      }
      return columns;
    };
    // How the states after an arc follow the jumps in it.
    const auto moved_by_jumps = [&](std::size_t arc) {
      MatrixXd moved = MatrixXd::Zero(d, of_jumps);
      for (std::size_t j = 0; j < jumps.size(); ++j) {
        if (is_in(jumps[j], arc)) {
          const MatrixXd A = linear.stages[arc].A_inverse.inverse();
          for (int k = 0; k < layout_.gyros; ++k) {
            const auto at = layout_.direction(k);
            const Index own = static_cast<Index>(j) * jump_.size();
            const Eigen::Matrix2d kept = A.block<2, 2>(at, at);
            moved.block<2, 2>(at, own + jump_.momentum(k)) = kept;
            moved.block<2, 3>(at, own + jump_.axes()) = kept * momentum_by_axes(arc, k);
          }
        }
      }
      return moved;
    };
    problem_.for_each_arc(found.before, beside, [&](std::size_t arc, const MatrixXd& fixes) {
      stretch.measure(fixes);
      const bool is_last = arc + 1 == problem_.arcs();
      if (!is_last) {
        stretch.move(linear.stages[arc], moved_by_jumps(arc));
      }
      if (arc + 1 == begins_[static_cast<std::size_t>(at_stretch) + 1]) {
        add_stretch(at_stretch++, stretch.form(is_last));
        stretch = Stretch(d, n - d, shapes);
      }
    });
    // Steps in place of the values of each stretch: a step changes all that follows.
    const Index own = kOfGyro * layout_.gyros;
    for (Index i = count - 1; i-- > 0;) {
      const Index at = at_steps + i * of_stretch();
      whole.middleRows(at, own) += whole.middleRows(at + of_stretch(), own);
    }
    for (Index i = count - 1; i-- > 0;) {
      const Index at = at_steps + i * of_stretch();
      whole.middleCols(at, own) += whole.middleCols(at + of_stretch(), own);
    }
    whole.block(at_steps + own, at_steps + own, 2L * layout_.gyros, 2L * layout_.gyros)
        .setIdentity();  // there is no step of the momenta at the start
    const MatrixXd rest = without_first(whole, at_others);
    MatrixXd follow;
    form_ = without_first(rest, static_cast<Index>(others.size()) + of_stretch(), &follow);
    follow_ = follow.middleRows(static_cast<Index>(others.size()), own);
    at_shapes_ = (count - 1) * of_stretch();
    at_jumps_ = at_shapes_ + lasting;
  }

  static std::size_t stretches(std::size_t arcs) {
    constexpr std::size_t kMost = 36;
    constexpr std::size_t kArcsAtLeast = 10;
    return std::min(kMost, arcs / kArcsAtLeast);
  }

  [[nodiscard]] Index steps() const { return static_cast<Index>(begins_.size()) - 2; }
  /// The arc that a step is at the beginning of.
  [[nodiscard]] std::size_t arc(Index step) const { return begins_[static_cast<std::size_t>(step) + 1]; }
  /// The middle of a stretch; steps are at the middle between two of them.
  [[nodiscard]] Time middle(Index stretch) const {
    const auto at = static_cast<std::size_t>(stretch);
    return problem_.begin_of((begins_[at] + begins_[at + 1]) / 2);
  }
  [[nodiscard]] Index parameter(Index step, int gyro, int i) const { return step * of_stretch() + kOfGyro * gyro + i; }
  [[nodiscard]] Index momentum(Index step, int gyro) const {
    return step * of_stretch() + kOfGyro * layout_.gyros + 2L * gyro;
  }
  [[nodiscard]] Index aberration() const { return at_shapes_; }
  [[nodiscard]] Index multiple(int i) const { return at_shapes_ + kOfAberration + Index{kOfMultiple} * i; }
  [[nodiscard]] Index readout(int gyro) const { return at_shapes_ + kBeforeReadout + Index{kOfShapesOfGyro} * gyro; }
  [[nodiscard]] Index case_of(int gyro) const { return readout(gyro) + kOfReadout; }
  [[nodiscard]] Index fields(int gyro) const { return case_of(gyro) + kOfCase; }
  /// Of the shapes of a jump, whose columns these are.
  [[nodiscard]] Index of_jump(std::size_t j) const { return at_jumps_ + static_cast<Index>(j) * jump_.size(); }
  [[nodiscard]] const ColumnsOfJump& jump() const { return jump_; }
  [[nodiscard]] Index size() const { return form_.rows() - 1; }
  /// Middle of a stretch, of the pass from 0 to 1.
  [[nodiscard]] double part(Index stretch) const {
    const auto at = static_cast<std::size_t>(stretch);
    return static_cast<double>(begins_[at] + begins_[at + 1]) / 2 / static_cast<double>(begins_.back());
  }

  /// The part of the pass that is after a step.
  [[nodiscard]] double part_after(Index step) const {
    return 1 - static_cast<double>(arc(step)) / static_cast<double>(begins_.back());
  }

  /// What moves as these columns times numbers of this 1-sigma; gets log_odds (of one try), and where these are above
  /// `worth_more_than`, size, sigma and what is off by it. `after`: what it makes of the parameters, where the columns
  /// are of shapes.
  void put_into(Change& change, const Eigen::SparseMatrix<double>& columns, const VectorXd& prior_sigma,
                double worth_more_than, const MatrixXd* after = nullptr) const {
    const MatrixXd by_form = form_.topLeftCorner(size(), size()) * columns;
    const auto D = prior_sigma.asDiagonal();
    MatrixXd root =
        MatrixXd(D * (columns.transpose() * by_form) * D) + MatrixXd::Identity(prior_sigma.size(), prior_sigma.size());
    static_cast<void>(to_root(root));  // positive definite: 1 and more
    const auto L = root.triangularView<Eigen::Lower>();
    const VectorXd white = L.solve(-(D * (columns.transpose() * form_.topRightCorner(size(), 1))));
    change.log_odds = white.squaredNorm() / 2 - root.diagonal().array().log().sum();
    if (change.log_odds <= worth_more_than) {
      return;
    }
    change.size = D * VectorXd(root.transpose().triangularView<Eigen::Upper>().solve(white));
    // The diagonal of L⁻ᵀ L⁻¹.
    MatrixXd inverse = MatrixXd::Identity(prior_sigma.size(), prior_sigma.size());
    solve_lower(root, inverse);
    change.sigma = D * VectorXd(inverse.colwise().norm().transpose());
    MatrixXd off_by = -(follow_.leftCols(size()) * columns);
    for (Index step = 0; step < steps(); ++step) {
      const double part = change.motion == Motion::kOrbital ? part_after(step) : 1;
      off_by += part * columns.middleRows(parameter(step, 0, 0), off_by.rows());
    }
    if (after != nullptr) {
      off_by += *after;
    }
    change.parameters_off = off_by * change.size;
    const MatrixXd half = inverse * (D * off_by.transpose());
    change.parameters_off_covariance = half.transpose() * half;
  }

 private:
  [[nodiscard]] Index of_stretch() const { return (kOfGyro + 2) * layout_.gyros; }

  const PassProblem& problem_;
  Layout layout_;
  std::vector<std::size_t> begins_;  ///< arcs where stretches begin, and their number
  MatrixXd form_;
  MatrixXd follow_;  ///< parameters by the variables, negated
  ColumnsOfJump jump_;
  Index at_shapes_ = 0;
  Index at_jumps_ = 0;
};

/// Looks for the polhode of each rotor, along the steps of its coefficients: first for the number of turns in the pass,
/// then for how the period changes as well.
class PolhodeSearch {
 public:
  /// `sigma`: prior of each amplitude, gyro by gyro.
  PolhodeSearch(const Constancy& pass, const PassProblem& problem, VectorXd sigma)
      : pass_(pass),
        zero_at_(problem.setup().on_board.orbital_phase_zero),
        begin_s_(to_seconds(pass.middle(0) - zero_at_)),
        span_s_(to_seconds(pass.middle(pass.steps()) - pass.middle(0))),
        sigma_(std::move(sigma)) {}

  [[nodiscard]] LikelyPolhode of_gyro(int gyro) const {
    constexpr double kStep = 0.25;         // of a turn: at the ends the angle is off by 23° at most
    constexpr double kStretchesATurn = 4;  // at least
    constexpr double kMostChange = 0.4;    // of the period, over the pass
    constexpr double kLeastTurns = 1.5;    // less looks like a warm-up or a jump
    constexpr double kWorthMore = 3;       // ln of the odds
    TurnsOfPolhode best{kLeastTurns, 0};
    double best_log_odds = -std::numeric_limits<double>::infinity();
    const auto consider = [&](double turns, double change) {
      check_stop();
      const bool is_one = turns >= kLeastTurns && std::abs(change) <= kMostChange;
      const double odds = is_one ? log_odds(gyro, {turns, change}) : best_log_odds;
      const bool is_better = odds > best_log_odds;
      if (is_better) {
        best = {turns, change};
        best_log_odds = odds;
      }
      return is_better;
    };
    const double most = static_cast<double>(pass_.steps() + 1) / kStretchesATurn;
    int tries = 0;  // those from here on are about the same polhode
    for (; kLeastTurns + kStep * tries <= most; ++tries) {
      consider(kLeastTurns + kStep * tries, 0);
    }
    if (best_log_odds - std::log(tries) > kWorthMore) {
      const TurnsOfPolhode first = best;
      for (const double change : {-0.4, -0.3, -0.2, -0.1, 0.1, 0.2, 0.3, 0.4}) {
        for (const double turns : {first.turns - kStep, first.turns, first.turns + kStep}) {
          consider(turns, change);
        }
      }
      for (double step = kStep / 2; step > 1e-3;) {
        const TurnsOfPolhode at = best;
        const bool is_better = consider(at.turns - step, at.change) || consider(at.turns + step, at.change) ||
                               consider(at.turns, at.change - step / 2) || consider(at.turns, at.change + step / 2);
        step /= is_better ? 1 : 2;
      }
    }
    return {best.polhode(begin_s_, span_s_), best_log_odds - std::log(tries)};
  }

 private:
  [[nodiscard]] double log_odds(int gyro, const TurnsOfPolhode& turns) const {
    const Polhode its = turns.polhode(begin_s_, span_s_);
    const auto angle = [&](Index stretch) { return its.angle_rad(to_seconds(pass_.middle(stretch) - zero_at_)); };
    std::vector<Eigen::Triplet<double>> entries;
    for (Index step = 0; step < pass_.steps(); ++step) {
      const double from = angle(step);
      const double to = angle(step + 1);
      for (int i = 0; i < Layout::kEq1; ++i) {
        entries.emplace_back(pass_.parameter(step, gyro, i), i, std::sin(to) - std::sin(from));
        entries.emplace_back(pass_.parameter(step, gyro, i), Layout::kEq1 + i, std::cos(to) - std::cos(from));
      }
    }
    Eigen::SparseMatrix<double> columns(pass_.size(), Layout::kPolhode);
    columns.setFromTriplets(entries.begin(), entries.end());
    Change its_odds;
    pass_.put_into(its_odds, columns, sigma_.segment<Layout::kEq1>(Index{Layout::kEq1} * gyro).replicate(2, 1),
                   std::numeric_limits<double>::infinity());
    return its_odds.log_odds;
  }

  const Constancy& pass_;
  Time zero_at_;
  double begin_s_;
  double span_s_;
  VectorXd sigma_;
};

}  // namespace

TurnsOfPolhode TurnsOfPolhode::of(const Polhode& polhode, double begin_s, double span_s) {
  const double turns = span_s / static_cast<double>(polhode.after(begin_s + span_s / 2).period_s);
  return {turns, static_cast<double>(polhode.period_rate) * turns};
}

Polhode TurnsOfPolhode::polhode(double begin_s, double span_s) const {
  const double rate = change / turns;
  return {static_cast<float>(span_s / turns - rate * (begin_s + span_s / 2)), static_cast<float>(rate)};
}

Moves moves_over(const Trial& trial) {
  constexpr std::size_t kEnoughStretches = 6;
  const PassProblem& problem = trial.problem();
  if (Constancy::stretches(problem.arcs()) < kEnoughStretches) {
    return {};
  }
  // In steady flight an alignment is as unknown as before, and what it makes with the drift is of second order: a fifth
  // of its sigma, enough for a decision, would look like something that moves.
  constexpr double kConverged = 0.01;
  std::optional<BatchResult> further;
  if (trial.found().step > kConverged) {
    further = most_likely(problem, trial.found().solution, kConverged);
  }
  const BatchResult& found = further ? *further : trial.found();
  const Jumps jumps = jumps_over(trial);
  const Constancy pass(problem, found, jumps.jumps);
  const Layout& layout = problem.layout();
  const Index steps = pass.steps();
  // What may be expected of each, 1-sigma: a case or a head that slips, a good one that creeps or goes to and fro,
  // coefficients that change by a tenth of what is expected of them, the Earth's orbital velocity over that of light
  // and a spacecraft's, scales as of a first ground calibration, or of better ones.
  constexpr double kSlips_rad = 60 * kArcsecond;
  constexpr double kCreeps_rad = 5 * kArcsecond;
  constexpr double kPartOfCoefficients = 0.1;
  constexpr double kPolhodeOverChange = 3;  // its states have a prior of 0.3 of that of the coefficients
  constexpr double kScales[] = {1e-3, 1e-4, 2e-5, 5e-6};
  constexpr double kFieldLarge_rad = 5 * kArcsecond;
  constexpr double kFieldSmall_rad = kArcsecond;
  const VectorXd member_rms = rms_of_fields();
  VectorXd coefficient_sigma(Index{Layout::kEq1} * layout.gyros);
  for (int k = 0; k < layout.gyros; ++k) {
    for (int i = 0; i < Layout::kEq1; ++i) {
      const Layout members = problem.setup().layout();
      const Index row = members.drift(k) + i - members.drift(0);
      coefficient_sigma(Layout::kEq1 * k + i) =
          kPartOfCoefficients * std::sqrt(problem.setup().prior.covariance(row, row));
    }
  }

  const auto what = [](Moving moving, Motion motion, int gyro, Time from = {}, Time until = {}) {
    Change change;
    change.moving = moving;
    change.motion = motion;
    change.gyro = gyro;
    change.from = from;
    change.until = until;
    return change;
  };
  constexpr double kTimesOfDecay[] = {0.05, 0.1, 0.2, 0.4};  // of the pass
  using Entries = std::vector<Eigen::Triplet<double>>;
  std::vector<Change> best;
  int tries = 0;
  const auto consider = [&](Change change, const Entries& entries, const VectorXd& sigma, double among = 1,
                            const MatrixXd* after = nullptr) {
    check_stop();
    ++tries;
    Eigen::SparseMatrix<double> columns(pass.size(), sigma.size());
    columns.setFromTriplets(entries.begin(), entries.end());
    const auto same = std::ranges::find_if(best, [&](const Change& other) {
      return other.moving == change.moving && other.motion == change.motion && other.gyro == change.gyro;
    });
    const bool is_first = same == best.end();
    const double worth_more_than = is_first ? -std::numeric_limits<double>::infinity() : same->log_odds;
    pass.put_into(change, columns, sigma, worth_more_than + std::log(among), after);
    change.log_odds -= std::log(among);
    if (is_first) {
      best.push_back(std::move(change));
    } else if (change.log_odds > same->log_odds) {
      *same = std::move(change);
    }
  };
  const auto sigmas = [](Index size, double sigma) { return VectorXd(VectorXd::Constant(size, sigma)); };
  const auto coefficients = [&](int gyro) {
    return gyro < 0 ? coefficient_sigma : VectorXd(coefficient_sigma.segment<Layout::kEq1>(Index{Layout::kEq1} * gyro));
  };
  /// Parameters that follow a course: its rise from each stretch to the next.
  const auto along = [&](int gyro, int from, int size, bool alike, const auto& rise) {
    Entries entries;
    for (int k = std::max(gyro, 0); k < (gyro < 0 ? layout.gyros : gyro + 1); ++k) {
      for (int i = 0; i < size; ++i) {
        const int column = gyro < 0 && !alike ? size * k + i : i;
        for (Index step = 0; step < steps; ++step) {
          if (const double by = rise(step); by != 0) {
            entries.emplace_back(pass.parameter(step, k, from + i), column, by);
          }
        }
      }
    }
    return entries;
  };
  const auto once_at = [](Index when) { return [when](Index step) { return step == when ? 1.0 : 0.0; }; };
  const auto evenly = [&](Index step) { return pass.part(step + 1) - pass.part(step); };
  const auto decaying = [&](double time) {
    return
        [&pass, time](Index step) { return std::exp(-pass.part(step) / time) - std::exp(-pass.part(step + 1) / time); };
  };

  const auto decays = [&](Moving moving, int gyro, double time) {
    Change decay = what(moving, Motion::kDecay, gyro);
    decay.decay = from_seconds(time * problem.setup().on_board.change.duration_s);
    return decay;
  };

  const auto at_orbital_rate = [&](double quarter) {
    return [&pass, quarter, rate_rad_s = problem.setup().on_board.orbital_rate_rad_s](Index step) {
      const auto phase = [&](Index stretch) { return rate_rad_s * to_seconds(pass.middle(stretch) - pass.middle(0)); };
      return std::cos(phase(step + 1) - quarter) - std::cos(phase(step) - quarter);
    };
  };

  for (int k = -1; k < layout.gyros; ++k) {
    const Moving moving = k < 0 ? Moving::kStarTracker : Moving::kGyroCase;
    for (const double rad : {kSlips_rad, kCreeps_rad}) {
      consider(what(moving, Motion::kRamp, k), along(k, Layout::kEq1, 3, true, evenly), sigmas(3, rad));
      for (const double time : kTimesOfDecay) {
        consider(decays(moving, k, time), along(k, Layout::kEq1, 3, true, decaying(time)), sigmas(3, rad));
      }
    }
    consider(what(Moving::kCoefficients, Motion::kRamp, k), along(k, 0, Layout::kEq1, false, evenly), coefficients(k));
    const VectorXd sigma = coefficients(k);
    Entries to_and_fro = along(k, 0, Layout::kEq1, false, at_orbital_rate(0));
    for (const auto& sine : along(k, 0, Layout::kEq1, false, at_orbital_rate(std::numbers::pi / 2))) {
      to_and_fro.emplace_back(sine.row(), sine.col() + sigma.size(), sine.value());
    }
    consider(what(Moving::kCoefficients, Motion::kOrbital, k), to_and_fro, sigma.replicate(2, 1));
    for (const double time : kTimesOfDecay) {
      consider(decays(Moving::kCoefficients, k, time), along(k, 0, Layout::kEq1, false, decaying(time)),
               coefficients(k));
    }
    for (Index step = 0; step < steps; ++step) {
      const Time from = pass.middle(step);
      const Time until = pass.middle(step + 1);
      for (const double rad : {kSlips_rad, kCreeps_rad}) {
        consider(what(moving, Motion::kStep, k, from, until), along(k, Layout::kEq1, 3, true, once_at(step)),
                 sigmas(3, rad));
      }
      consider(what(Moving::kCoefficients, Motion::kStep, k, from, until),
               along(k, 0, Layout::kEq1, false, once_at(step)), coefficients(k));
      Entries entries;
      for (int gyro = std::max(k, 0); gyro < (k < 0 ? layout.gyros : k + 1); ++gyro) {
        const Eigen::Matrix<double, 2, 3> by_turn = across(found.before.arcs[pass.arc(step)].h_in[gyro]).transpose();
        for (int i = 0; i < 2; ++i) {
          for (int j = 0; k < 0 && j < 3; ++j) {
            entries.emplace_back(pass.momentum(step, gyro) + i, j, by_turn(i, j));
          }
          if (k >= 0) {
            entries.emplace_back(pass.momentum(step, gyro) + i, i, 1);
          }
        }
      }
      consider(what(k < 0 ? Moving::kInertialAxes : Moving::kMomentum, Motion::kStep, k, from, until), entries,
               sigmas(k < 0 ? 3 : 2, kSlips_rad));
    }
  }
  const auto shape = [](Index at, Index size) {
    Entries entries;
    for (Index i = 0; i < size; ++i) {
      entries.emplace_back(at + i, i, 1);
    }
    return entries;
  };
  consider(what(Moving::kAberration, Motion::kPresent, -1), shape(pass.aberration(), kOfAberration),
           sigmas_of_aberration());
  for (int i = 0; i < kMultiplesOfRate; ++i) {
    consider(what(Moving::kStarTracker, Motion::kFaster, -1), shape(pass.multiple(i), kOfMultiple),
             sigmas(kOfMultiple, kCreeps_rad));
  }
  for (int k = 0; k < layout.gyros; ++k) {
    for (const double scale : kScales) {
      consider(what(Moving::kReadoutScale, Motion::kPresent, k), shape(pass.readout(k), kOfReadout),
               sigmas(kOfReadout, scale));
    }
    consider(what(Moving::kGyroCase, Motion::kOrbital, k), shape(pass.case_of(k), kOfCase),
             sigmas(kOfCase, kCreeps_rad));
  }
  for (const double rad : {kFieldLarge_rad, kFieldSmall_rad}) {
    const VectorXd sigma = rad / std::sqrt(static_cast<double>(kFields.size())) * member_rms.cwiseInverse();
    Entries of_all;
    for (int k = 0; k < layout.gyros; ++k) {
      const Entries own = shape(pass.fields(k), kFields.size());
      consider(what(Moving::kReadoutField, Motion::kPresent, k), own, sigma);
      for (const auto& entry : own) {
        of_all.emplace_back(entry.row(), entry.col() + kFields.size() * k, entry.value());
      }
    }
    consider(what(Moving::kReadoutField, Motion::kPresent, -1), of_all, sigma.replicate(layout.gyros, 1));
  }
  for (std::size_t j = 0; j < jumps.jumps.size(); ++j) {
    const auto& [from, until] = jumps.jumps[j];
    const auto among = static_cast<double>(jumps.among);
    for (int k = -1; k < layout.gyros; ++k) {
      MatrixXd after = MatrixXd::Zero(kOfGyro * layout.gyros, 3);
      for (int gyro = std::max(k, 0); gyro < (k < 0 ? layout.gyros : k + 1); ++gyro) {
        after.middleRows<3>(kOfGyro * gyro + Layout::kEq1).setIdentity();
      }
      const Index of_case = pass.of_jump(j) + (k < 0 ? ColumnsOfJump::kAllCases : ColumnsOfJump::case_of(k));
      for (const double rad : {kSlips_rad, kCreeps_rad}) {
        consider(what(k < 0 ? Moving::kStarTracker : Moving::kGyroCase, Motion::kStep, k, from, until),
                 shape(of_case, 3), sigmas(3, rad), among, &after);
      }
      const Index of_momentum = pass.of_jump(j) + (k < 0 ? pass.jump().axes() : pass.jump().momentum(k));
      const Index size = k < 0 ? 3 : 2;
      consider(what(k < 0 ? Moving::kInertialAxes : Moving::kMomentum, Motion::kStep, k, from, until),
               shape(of_momentum, size), sigmas(size, kSlips_rad), among);
    }
  }
  for (const double part : {0.01, 0.03, 0.1, 0.3, 1.0}) {
    Entries entries;
    VectorXd sigma(steps * coefficient_sigma.size());
    for (Index step = 0; step < steps; ++step) {
      for (Index i = 0; i < coefficient_sigma.size(); ++i) {
        const Index column = step * coefficient_sigma.size() + i;
        const auto member = static_cast<int>(i);
        entries.emplace_back(pass.parameter(step, member / Layout::kEq1, member % Layout::kEq1), column, 1);
        sigma(column) = part * coefficient_sigma(i) / std::sqrt(static_cast<double>(steps));
      }
    }
    consider(what(Moving::kCoefficients, Motion::kWalk, -1), entries, sigma);
  }
  for (Change& change : best) {
    change.log_odds -= std::log(tries);
    if (change.moving == Moving::kStarTracker) {  // found as that of the cases against it
      change.size = -change.size;
    } else if (change.motion == Motion::kWalk) {
      change.size = VectorXd::Constant(1, change.size.norm());
      change.sigma = VectorXd::Constant(1, change.sigma.norm());
    } else if (change.moving == Moving::kReadoutField) {
      const auto rms = [&](const VectorXd& amplitudes) {  // of the gyros together, as of one
        const Eigen::Index gyros = amplitudes.size() / member_rms.size();
        const Eigen::ArrayXd each = member_rms.replicate(gyros, 1).array();
        return each.isFinite().select(each * amplitudes.array(), 0.0).matrix().norm() /
               std::sqrt(static_cast<double>(gyros));
      };
      change.size = VectorXd::Constant(1, rms(change.size));
      change.sigma = VectorXd::Constant(1, rms(change.sigma));
    }
  }
  std::ranges::sort(best, [](const Change& a, const Change& b) { return a.log_odds > b.log_odds; });
  Moves moves{std::move(best), {}};
  const PolhodeSearch search(pass, problem, kPolhodeOverChange * coefficient_sigma);
  for (int k = 0; k < layout.gyros; ++k) {
    moves.polhodes[k] = search.of_gyro(k);
  }
  return moves;
}

namespace {

/// Of shapes that are rows · beside() with the states of a trial: what the whole pass says of their sizes, all states
/// eliminated; information, and right of it its right side.
template <class Beside>
MatrixXd information_on_shapes(const Trial& trial, Index shapes, const Beside& beside) {
  const PassProblem& problem = trial.problem();
  const BatchResult& found = trial.found();
  const Index d = problem.layout().dynamic();
  const Index constants = problem.layout().size() - d;
  Stretch whole(d, constants, shapes);
  whole.measure(prior_rows(found.linear, shapes));
  problem.for_each_arc(found.before, beside, [&](std::size_t arc, const MatrixXd& fixes) {
    whole.measure(fixes);
    if (arc + 1 < problem.arcs()) {
      whole.move(found.linear.stages[arc], MatrixXd(d, 0));
    }
  });
  return without_first(without_states_at_end(whole.form(true), d), d + constants);
}

/// Of these shapes from one on, with these 1-sigmas.
LogEvidence evidence_of_shapes(const MatrixXd& information, Index at, const VectorXd& sigma) {
  const Index size = sigma.size();
  return log_evidence_of(sigma.asDiagonal() * information.block(at, at, size, size) * sigma.asDiagonal(),
                         sigma.cwiseProduct(information.col(information.cols() - 1).segment(at, size)));
}

}  // namespace

OrbitalOdds orbital_odds(const Trial& trial) {
  const PassProblem& problem = trial.problem();
  const CalibrationSetup& setup = problem.setup().on_board;
  const double rate_rad_s = setup.orbital_rate_rad_s;
  const int gyros = problem.layout().gyros;
  constexpr Index kOfOne = 6;  // of sine and cosine about c x, y, z; so is the drift of a gyro
  const Index errors = kOfOne * problem.layout().star_trackers;
  const Index drifts = kOfOne * gyros;
  TurnedByOrbitalDrift drift(rate_rad_s, setup.orbital_phase_zero);
  const auto beside = [&](const PassProblem::Moment& moment, const Layout& layout, const MatrixXd& rows) {
    MatrixXd shapes = MatrixXd::Zero(rows.rows(), errors + drifts);
    const double phase = rate_rad_s * to_seconds(moment.t - setup.orbital_phase_zero);
    add_error_at(phase, rows, layout, shapes.middleCols<kOfOne>(kOfOne * moment.fix->fix.head));
    const Eigen::Quaterniond q_in_c = moment.fix->fix.q_in_c.normalized();
    drift.go_to(moment.t, q_in_c);
    const Eigen::Matrix<double, 3, kOfOne> turned_c = q_in_c.conjugate().toRotationMatrix() * drift.turned_in();
    for (int k = 0; k < gyros; ++k) {
      const auto by_alignment = rows.middleCols<3>(layout.alignment(k));
      shapes.middleCols<kOfOne>(errors + kOfOne * k) = by_alignment.lazyProduct(turned_c);
    }
    return shapes;
  };
  const MatrixXd form = information_on_shapes(trial, errors + drifts, beside);
  const double error_rad = kind_of(FurtherState::kOrbitalError).prior_sigma;
  const double drift_rad_s = std::abs(rate_rad_s) * error_rad;
  const LogEvidence error = evidence_of_shapes(form, 0, VectorXd::Constant(errors, error_rad));
  MatrixXd with_prior = form;
  with_prior.diagonal().head(errors).array() += 1 / (error_rad * error_rad);
  const LogEvidence beside_error =
      evidence_of_shapes(without_first(with_prior, errors), 0, VectorXd::Constant(drifts, drift_rad_s));
  return {error,
          evidence_of_shapes(form, errors, VectorXd::Constant(drifts, drift_rad_s)),
          {error.by_prior_as_it_is + beside_error.value, error.by_prior_as_it_is + beside_error.by_prior_as_it_is}};
}

OddsOfErrors odds_of_errors(const Trial& trial) {
  constexpr int kHarmonics = 6;
  constexpr Index kOfOne = 6;
  const PassProblem& problem = trial.problem();
  const CalibrationSetup& setup = problem.setup().on_board;
  const Index of_all = kOfOne * problem.layout().star_trackers;
  const Index harmonics = of_all * kHarmonics;
  const auto beside = [&](const PassProblem::Moment& moment, const Layout& layout, const MatrixXd& rows) {
    MatrixXd errors = MatrixXd::Zero(rows.rows(), harmonics + kOfAberration);
    const double phase = setup.orbital_rate_rad_s * to_seconds(moment.t - setup.orbital_phase_zero);
    for (int i = 0; i < kHarmonics; ++i) {
      add_error_at((i + 1) * phase, rows, layout,
                   errors.middleCols<kOfOne>(of_all * i + kOfOne * moment.fix->fix.head));
    }
    if (moment.fix->fix.head == 0) {
      add_aberration(moment, phase, rows, layout, errors.rightCols<kOfAberration>());
    }
    return errors;
  };
  const MatrixXd information = information_on_shapes(trial, harmonics + kOfAberration, beside);
  const double error_rad = kind_of(FurtherState::kOrbitalError).prior_sigma;
  double with_orbit = -std::numeric_limits<double>::infinity();
  for (int count = 1; count <= kHarmonics; ++count) {
    const VectorXd sigma = VectorXd::Constant(of_all * count, error_rad);
    with_orbit = std::max(with_orbit, evidence_of_shapes(information, 0, sigma).value);
  }
  return {with_orbit - std::log(kHarmonics), evidence_of_shapes(information, harmonics, sigmas_of_aberration()).value};
}

}  // namespace trihedron::ground
