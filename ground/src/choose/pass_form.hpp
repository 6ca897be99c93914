#pragma once
/// A whole pass as a form of what may move in it.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <vector>

#include "batch/batch.hpp"
#include "choose/error_shapes.hpp"
#include "choose/jumps.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Coefficients of eq. (1) and the alignment of one gyro.
inline constexpr Eigen::Index kParametersOfGyro = Layout::kEq1 + 3;

/// Columns of the shapes of one jump: rotations of all cases, of each, steps of each momentum, rotations of the
/// inertial axes.
struct ColumnsOfJump {
  int gyros;

  static constexpr Eigen::Index kAllCases = 0;
  [[nodiscard]] static Eigen::Index case_of(int gyro) { return 3 + 3L * gyro; }
  [[nodiscard]] Eigen::Index momentum(int gyro) const { return 3 + 3L * gyros + 2L * gyro; }
  [[nodiscard]] Eigen::Index axes() const { return 3 + 5L * gyros; }
  [[nodiscard]] Eigen::Index size() const { return 6 + 5L * gyros; }
};

/// The whole pass as a form of what may move, all else eliminated. The pass is cut into stretches; the variables are
/// the steps of the parameters at the beginning of each stretch but the first, those of the momenta, shapes of errors,
/// shapes of jumps, 1.
class PassForm {
 public:
  /// `found`: converged, so that its rows are about what is most likely.
  PassForm(const PassProblem& problem, const BatchResult& found, const std::vector<Jump>& jumps);

  /// Into how many a pass of that many arcs is cut.
  [[nodiscard]] static std::size_t stretches(std::size_t arcs);

  [[nodiscard]] Eigen::Index steps() const { return static_cast<Eigen::Index>(begins_.size()) - 2; }
  /// The arc that a step is at the beginning of.
  [[nodiscard]] std::size_t arc(Eigen::Index step) const { return begins_[static_cast<std::size_t>(step) + 1]; }
  /// The middle of a stretch; steps are at the middle between two of them.
  [[nodiscard]] Time middle(Eigen::Index stretch) const {
    const auto at = static_cast<std::size_t>(stretch);
    return problem_.begin_of((begins_[at] + begins_[at + 1]) / 2);
  }
  /// Middle of a stretch, of the pass from 0 to 1.
  [[nodiscard]] double part(Eigen::Index stretch) const {
    const auto at = static_cast<std::size_t>(stretch);
    return static_cast<double>(begins_[at] + begins_[at + 1]) / 2 / static_cast<double>(begins_.back());
  }

  /// The number of variables but 1, and where they are.
  [[nodiscard]] Eigen::Index size() const { return form_.rows() - 1; }
  [[nodiscard]] Eigen::Index parameter(Eigen::Index step, int gyro, int i) const {
    return step * of_stretch() + kParametersOfGyro * gyro + i;
  }
  [[nodiscard]] Eigen::Index momentum(Eigen::Index step, int gyro) const {
    return step * of_stretch() + kParametersOfGyro * gyros_ + 2L * gyro;
  }
  /// Of a column of ErrorColumns.
  [[nodiscard]] Eigen::Index error(Eigen::Index column) const { return at_errors_ + column; }
  /// Of a column of a jump's.
  [[nodiscard]] Eigen::Index jump(std::size_t j, Eigen::Index column) const {
    return at_jumps_ + static_cast<Eigen::Index>(j) * columns_of_jump().size() + column;
  }
  [[nodiscard]] ColumnsOfJump columns_of_jump() const { return {gyros_}; }

  /// What moves as these columns times numbers of this 1-sigma; gets log_odds (of one try), and where these are above
  /// `worth_more_than`, size, sigma and what is off by it. `after`: what it makes of the parameters, where the columns
  /// are of shapes.
  void put_into(Change& change, const Eigen::SparseMatrix<double>& columns, const Eigen::VectorXd& prior_sigma,
                double worth_more_than, const Eigen::MatrixXd* after = nullptr) const;

 private:
  [[nodiscard]] Eigen::Index of_stretch() const { return (kParametersOfGyro + 2) * gyros_; }
  /// The part of the pass that is after a step.
  [[nodiscard]] double part_after(Eigen::Index step) const {
    return 1 - static_cast<double>(arc(step)) / static_cast<double>(begins_.back());
  }

  const PassProblem& problem_;
  int gyros_;
  std::vector<std::size_t> begins_;  ///< arcs where stretches begin, and their number
  Eigen::MatrixXd form_;
  Eigen::MatrixXd follow_;  ///< parameters by the variables, negated
  Eigen::Index at_errors_ = 0;
  Eigen::Index at_jumps_ = 0;
};

}  // namespace trihedron::ground
