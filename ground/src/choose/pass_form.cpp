#include "choose/pass_form.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <mutex>
#include <utility>

#include "choose/stretch.hpp"
#include "linear/gram.hpp"

namespace trihedron::ground {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Constants of a layout, counted from the first state that does not move: those of the gyros in the order of
/// PassForm::parameter(), and the others.
struct Constants {
  explicit Constants(const Layout& layout) {
    for (Index c = layout.dynamic(); c < layout.size(); ++c) {
      bool is_of_gyro = false;
      for (int k = 0; k < layout.gyros; ++k) {
        is_of_gyro = is_of_gyro || (c >= layout.drift(k) && c < layout.drift(k) + Layout::kEq1) ||
                     (c >= layout.alignment(k) && c < layout.alignment(k) + 3);
      }
      (is_of_gyro ? of_gyros : others).push_back(c - layout.dynamic());
    }
  }

  std::vector<Index> of_gyros;
  std::vector<Index> others;
};

/// Shapes of jumps, beside the rows of fixes and beside what goes on from arc to arc.
class ShapesOfJumps {
 public:
  ShapesOfJumps(const PassProblem& problem, const BatchResult& found, const std::vector<Jump>& jumps)
      : problem_(problem), found_(found), jumps_(jumps), columns_{problem.layout().gyros} {}

  [[nodiscard]] Index size() const { return static_cast<Index>(jumps_.size()) * columns_.size(); }

  /// Puts into `shapes` what the jumps before a fix have moved.
  void put(const PassProblem::Moment& moment, const Layout& layout, const MatrixXd& rows,
           Eigen::Ref<MatrixXd> shapes) const {
    for (std::size_t j = 0; j < jumps_.size(); ++j) {
      if (moment.t < jumps_[j].after) {
        continue;
      }
      auto own = shapes.middleCols(static_cast<Index>(j) * columns_.size(), columns_.size());
      for (int k = 0; k < layout.gyros; ++k) {
        const auto by_alignment = rows.middleCols<3>(layout.alignment(k));
        own.middleCols<3>(ColumnsOfJump::kAllCases) += by_alignment;
        own.middleCols<3>(ColumnsOfJump::case_of(k)) = by_alignment;
        if (is_in(jumps_[j], moment.arc)) {
          const Eigen::Matrix<double, Eigen::Dynamic, 2> by_momentum = rows.middleCols<2>(layout.direction(k));
          own.middleCols<2>(columns_.momentum(k)) = by_momentum;
          own.middleCols<3>(columns_.axes()) += by_momentum.lazyProduct(momentum_by_axes(moment.arc, k));
        }
      }
    }
  }

  /// How the states after an arc follow the jumps in it.
  [[nodiscard]] MatrixXd moved_in(std::size_t arc) const {
    const Layout& layout = problem_.layout();
    MatrixXd moved = MatrixXd::Zero(layout.dynamic(), size());
    for (std::size_t j = 0; j < jumps_.size(); ++j) {
      if (!is_in(jumps_[j], arc)) {
        continue;
      }
      const MatrixXd A = found_.linear.stages[arc].A_inverse.inverse();
      for (int k = 0; k < layout.gyros; ++k) {
        const auto at = layout.direction(k);
        const Index own = static_cast<Index>(j) * columns_.size();
        const Eigen::Matrix2d kept = A.block<2, 2>(at, at);
        moved.block<2, 2>(at, own + columns_.momentum(k)) = kept;
        moved.block<2, 3>(at, own + columns_.axes()) = kept * momentum_by_axes(arc, k);
      }
    }
    return moved;
  }

 private:
  [[nodiscard]] Eigen::Matrix<double, 2, 3> momentum_by_axes(std::size_t arc, int gyro) const {
    return across(found_.before.arcs[arc].h_in[gyro]).transpose();
  }
  [[nodiscard]] bool is_in(const Jump& jump, std::size_t arc) const {
    return problem_.begin_of(arc) <= jump.after &&
           (arc + 1 == problem_.arcs() || jump.after < problem_.begin_of(arc + 1));
  }

  const PassProblem& problem_;
  const BatchResult& found_;
  const std::vector<Jump>& jumps_;
  ColumnsOfJump columns_;
};

/// The forms of all stretches as one. Variables: the states that move at the beginnings of the stretches; the other
/// constants; parameters and steps of the momenta stretch by stretch; shapes; 1.
class FormOfAll {
 public:
  FormOfAll(const Layout& layout, Index stretches, Index shapes)
      : stretches_(stretches),
        moving_(layout.dynamic()),
        shapes_(shapes),
        directions_(2L * layout.gyros),
        parameters_(kParametersOfGyro * layout.gyros),
        constants_(layout) {
    at_others_ = stretches_ * moving_;
    at_steps_ = at_others_ + others();
    at_shapes_ = at_steps_ + stretches_ * of_stretch();
    form_.setZero(at_shapes_ + shapes + 1, at_shapes_ + shapes + 1);
  }

  /// The next of the stretches, i.
  void add(Index i, const MatrixXd& stretch) {
    const std::vector<Index> place = places_of(i);
    form_(place, place) += stretch;
    if (i + 1 == stretches_) {
      return;
    }
    // The states at its end are those of the next beginning less the step there.
    const Index step = at_steps_ + (i + 1) * of_stretch() + parameters_;
    for (Index j = 0; j < directions_; ++j) {
      for (std::size_t row = 0; row < place.size(); ++row) {
        const double value = stretch(moving_ + j, static_cast<Index>(row));
        form_(step + j, place[row]) -= value;
        form_(place[row], step + j) -= value;
      }
    }
    form_.block(step, step, directions_, directions_) += stretch.block(moving_, moving_, directions_, directions_);
  }

  /// When all are added: steps in place of the values of each stretch. A step changes all that follows.
  void take_steps() {
    for (Index i = stretches_ - 1; i-- > 0;) {
      const Index at = at_steps_ + i * of_stretch();
      form_.middleRows(at, parameters_) += form_.middleRows(at + of_stretch(), parameters_);
    }
    for (Index i = stretches_ - 1; i-- > 0;) {
      const Index at = at_steps_ + i * of_stretch();
      form_.middleCols(at, parameters_) += form_.middleCols(at + of_stretch(), parameters_);
    }
    form_.block(at_steps_ + parameters_, at_steps_ + parameters_, directions_, directions_)
        .setIdentity();  // there is no step of the momenta at the start
  }

  /// The form of the steps from the second stretch on, shapes and 1. `follow`: how the parameters of the first stretch
  /// follow these, negated. To be called last: the form is given up.
  [[nodiscard]] MatrixXd eliminated(MatrixXd& follow) {
    form_ = without_first(form_, at_others_);
    MatrixXd all_follow;
    MatrixXd left = without_first(form_, others() + of_stretch(), &all_follow);
    follow = all_follow.middleRows(others(), parameters_);
    return left;
  }

 private:
  [[nodiscard]] Index others() const { return static_cast<Index>(constants_.others.size()); }
  [[nodiscard]] Index of_stretch() const { return parameters_ + directions_; }

  /// Where the variables of a stretch are. The states at the end of the last one are zero.
  [[nodiscard]] std::vector<Index> places_of(Index i) const {
    const Index constants = others() + static_cast<Index>(constants_.of_gyros.size());
    std::vector<Index> place(static_cast<std::size_t>(2 * moving_ + constants + shapes_ + 1));
    for (Index j = 0; j < moving_; ++j) {
      place[static_cast<std::size_t>(j)] = i * moving_ + j;
      place[static_cast<std::size_t>(moving_ + j)] = std::min(i + 1, stretches_ - 1) * moving_ + j;
    }
    const auto after_states = [&](Index c) -> Index& { return place[static_cast<std::size_t>(2 * moving_ + c)]; };
    for (std::size_t j = 0; j < constants_.others.size(); ++j) {
      after_states(constants_.others[j]) = at_others_ + static_cast<Index>(j);
    }
    for (std::size_t j = 0; j < constants_.of_gyros.size(); ++j) {
      after_states(constants_.of_gyros[j]) = at_steps_ + i * of_stretch() + static_cast<Index>(j);
    }
    for (Index j = 0; j <= shapes_; ++j) {
      after_states(constants + j) = at_shapes_ + j;
    }
    return place;
  }

  Index stretches_;
  Index moving_;
  Index shapes_;
  Index directions_;
  Index parameters_;
  Constants constants_;
  Index at_others_;
  Index at_steps_;
  Index at_shapes_;
  MatrixXd form_;
};

}  // namespace

std::size_t PassForm::stretches(std::size_t arcs) {
  constexpr std::size_t kMost = 36;
  constexpr std::size_t kArcsAtLeast = 10;
  return std::min(kMost, arcs / kArcsAtLeast);
}

PassForm::PassForm(const PassProblem& problem, const BatchResult& found, const std::vector<Jump>& jumps)
    : problem_(problem), gyros_(problem.layout().gyros) {
  const std::size_t count = stretches(problem.arcs());
  for (std::size_t i = 0; i <= count; ++i) {
    begins_.push_back(i * problem.arcs() / count);
  }
  const Index moving = problem.layout().dynamic();
  const Index constants = problem.layout().size() - moving;
  const Index errors = ErrorColumns{gyros_}.size();
  const ShapesOfJumps of_jumps(problem, found, jumps);
  const Index shapes = errors + of_jumps.size();
  const DriftModel fields(ErrorColumns::kFields, {});
  const auto beside = [&](const PassProblem::Moment& moment, const Layout& layout, const MatrixXd& rows) {
    MatrixXd columns = shapes_of_errors(problem.setup().on_board, fields, moment, layout, rows, of_jumps.size());
    of_jumps.put(moment, layout, rows, columns.rightCols(of_jumps.size()));
    return columns;
  };
  FormOfAll all(problem.layout(), static_cast<Index>(count), shapes);
  std::vector<Stretch> parts(count, Stretch(moving, constants, shapes));
  parts.front().measure(prior_rows(found.linear, shapes));
  std::vector<MatrixXd> forms(count);  // that wait for those before them: sums do not depend on the number of threads
  std::size_t added = 0;
  std::mutex one_at_a_time;
  problem.for_each_arc(found.before, begins_, beside, [&](std::size_t part, std::size_t arc, const MatrixXd& fixes) {
    Stretch& stretch = parts[part];
    stretch.measure(fixes);
    const bool is_last = arc + 1 == problem.arcs();
    if (!is_last) {
      stretch.move(found.linear.stages[arc], of_jumps.moved_in(arc));
    }
    if (arc + 1 == begins_[part + 1]) {
      MatrixXd form = stretch.form(is_last);
      stretch = Stretch(moving, constants, shapes);
      const std::scoped_lock lock(one_at_a_time);
      forms[part] = std::move(form);
      for (; added < count && forms[added].size() > 0; ++added) {
        all.add(static_cast<Index>(added), std::exchange(forms[added], MatrixXd()));
      }
    }
  });
  all.take_steps();
  form_ = all.eliminated(follow_);
  at_errors_ = steps() * of_stretch();
  at_jumps_ = at_errors_ + errors;
}

void PassForm::put_into(Change& change, const Eigen::SparseMatrix<double>& columns, const VectorXd& prior_sigma,
                        double worth_more_than, const MatrixXd* after) const {
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

}  // namespace trihedron::ground
