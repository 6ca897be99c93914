#pragma once
/// A part of a pass as a sum of squares, with shapes of errors of its fixes beside its states.

#include <Eigen/Core>
#include <vector>

#include "batch/pass_problem.hpp"

namespace trihedron::ground {

/// A stretch of the pass as a sum of squares, a form zᵀ Q z of the states that move at its beginning and at its end, of
/// constants, of shapes of errors of the fixes, and of 1. What moves at the beginning counts as constant in it.
class Stretch {
 public:
  Stretch(Eigen::Index moving, Eigen::Index constants, Eigen::Index shapes) : d_(moving), rest_(constants + shapes) {}

  /// Rows about the states of the arc that it has come to, constants, shapes, and what they are compared with; unit
  /// noise.
  void measure(const Eigen::MatrixXd& rows);

  /// Goes on to the beginning of the next arc. `by_shapes`: of its states, by those shapes of which a part happens in
  /// this one, the last of all.
  void move(const SmootherStage& its, const Eigen::MatrixXd& by_shapes);

  /// `is_last`: of the states at its end nothing more will be known, and they are eliminated. To be called once.
  [[nodiscard]] Eigen::MatrixXd form(bool is_last);

 private:
  void add_to_prior(const Eigen::MatrixXd& rows, const Eigen::VectorXd& y);

  Eigen::Index d_;
  Eigen::Index rest_;
  Eigen::MatrixXd prior_;  ///< of its second arc: all of the first, and how the pass goes on from there
  Eigen::VectorXd prior_y_;
  std::vector<SmootherStage> stages_;  ///< from the second arc on
};

/// Removes the first variables of a form, to their likeliest values. `follow`: how these follow the others, negated.
[[nodiscard]] Eigen::MatrixXd without_first(const Eigen::MatrixXd& form, Eigen::Index size,
                                            Eigen::MatrixXd* follow = nullptr);

/// The form of a last stretch, which has none of the states at its end, without their place.
[[nodiscard]] Eigen::MatrixXd without_states_at_end(const Eigen::MatrixXd& form, Eigen::Index states);

/// The prior as rows that a stretch takes.
[[nodiscard]] Eigen::MatrixXd prior_rows(const PassProblem::Linear& linear, Eigen::Index shapes);

}  // namespace trihedron::ground
