#pragma once
/// Fixed-interval smoothing with the square root of the information matrix, sizes known at run time (Bierman,
/// "Factorization Methods for Discrete Sequential Estimation", 1977, chapter X; Dyer and McReynolds, 1969).

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "linear/gram.hpp"

namespace trihedron::ground {

/// One stage of a linear system of states x = (d, c), of which the constants c are the same in all stages: what is
/// measured in it, y = H x + unit white noise, and how it goes on, d' = A d + B c + m + noise ∘ w, w unit white.
struct SmootherStage {
  Eigen::MatrixXd H;
  Eigen::VectorXd y;
  Eigen::MatrixXd A_inverse;
  LongRows B;
  Eigen::VectorXd m;
  Eigen::VectorXd noise;  ///< 1-sigma, may be zero
};

/// How well a solution fits.
struct SmootherLikelihood {
  double residual_square = 0;       ///< of all measurements and of w at the estimate: −2 ln of the largest density
  double log_root_determinant = 0;  ///< ln |det R|, R the root of the information: of c and all d and w together
};

struct SmootherResult {
  std::vector<Eigen::VectorXd> x;  ///< estimate of the states of each stage by all measurements
  Eigen::MatrixXd last_root;       ///< of their covariance in the last stage, root rootᵀ
  SmootherLikelihood likelihood;

  /// w of one step by the states after it: R w + S x' = z with unit noise.
  struct NoiseRows {
    Eigen::MatrixXd R;
    Eigen::MatrixXd S;
    Eigen::VectorXd z;
  };
  std::vector<NoiseRows> steps;
};

/// Estimates all stages. `prior`: rows and right side of the prior of the first stage, unit noise. Throws
/// SetupError where a state has no information.
[[nodiscard]] SmootherResult smooth(const Eigen::MatrixXd& prior, const Eigen::VectorXd& prior_y,
                                    const std::vector<SmootherStage>& stages);

/// The likelihood alone. `stage(i)` is asked for each of the `stages` once, in their order, so that they need not be
/// kept. Throws as smooth().
[[nodiscard]] SmootherLikelihood likelihood(const Eigen::MatrixXd& prior, const Eigen::VectorXd& prior_y,
                                            std::size_t stages, const std::function<SmootherStage(std::size_t)>& stage);

/// What is known of the constants when all states that move are eliminated.
struct ConstantsInformation {
  LongRows moving;          ///< about the states of the last stage, right side last: what is known of those that move
  Eigen::MatrixXd squares;  ///< products of the columns of their rows, right side last; lower triangle
  double log_root_determinant = 0;  ///< ln |det R| of d of the last stage and of all w
};

/// The constants need no information. `stage`: as of likelihood(). By normal equations, a fraction of the work of a
/// triangle, which lower_root() makes of them: combinations of the constants of which more is known than 1e-10 of what
/// is known of each constant if the others were known have four digits and more.
[[nodiscard]] ConstantsInformation eliminate_moving(const Eigen::MatrixXd& prior, const Eigen::VectorXd& prior_y,
                                                    std::size_t stages,
                                                    const std::function<SmootherStage(std::size_t)>& stage);

/// Products of the columns of rows about constants, right side last.
class ConstantSquares {
 public:
  explicit ConstantSquares(Eigen::Index columns);

  template <class Rows>
  void add(const Rows& rows) {
    make_room(rows.rows());
    rows_.middleCols(size_, rows.rows()) = rows.transpose();
    size_ += rows.rows();
  }

  /// The lower triangle of the products of all rows since the last call.
  [[nodiscard]] Eigen::MatrixXd take();

 private:
  static constexpr Eigen::Index kBufferedRows = 256;
  void make_room(Eigen::Index rows);
  void put_into_squares();

  Eigen::MatrixXd rows_;  ///< a column for each
  Eigen::Index size_ = 0;
  Eigen::MatrixXd squares_;
};

/// The lower triangle L with L Lᵀ = squares, of which the lower triangle is used; combinations of columns that are zero
/// to rounding stay so small. NaN where a number is.
[[nodiscard]] Eigen::MatrixXd lower_root(const Eigen::MatrixXd& squares);

/// Moves the rows of a stage that are about the constants alone into `constants`. d: number of the states that move.
void take_constants(SmootherStage& stage, Eigen::Index d, ConstantSquares& constants);
/// Puts what was taken back as a triangle, into the same stage or a later one: the constants are the same in all.
void put_back(ConstantSquares& constants, Eigen::Index d, SmootherStage& stage);

/// Moves the rows of the stages that are about the constants alone to the prior, below the rows that are there. They
/// are most of all rows, and do not depend on the noise: smooth() can then be called with different noise in a fraction
/// of the time.
void gather_constants(Eigen::MatrixXd& prior, Eigen::VectorXd& prior_y, std::vector<SmootherStage>& stages);

/// Triangles of the information of prior and measurements up to the end of each stage of `after` (increasing) on its
/// states, right side last; the corner holds the residual.
[[nodiscard]] std::vector<Eigen::MatrixXd> triangles_after(const Eigen::MatrixXd& prior, const Eigen::VectorXd& prior_y,
                                                           const std::vector<SmootherStage>& stages,
                                                           const std::vector<std::size_t>& after);

/// Triangular roots of the information on the constants by the measurements up to the end of each stage of `after`
/// (increasing), with the states that move eliminated. `prior`: rows of the prior of these, unit noise.
[[nodiscard]] std::vector<Eigen::MatrixXd> information_on_constants(const Eigen::MatrixXd& prior,
                                                                    const std::vector<SmootherStage>& stages,
                                                                    const std::vector<std::size_t>& after);

/// The square triangle with the same information as `rows`, the last column of both being the right side (Householder).
[[nodiscard]] Eigen::MatrixXd triangle_of(const Eigen::MatrixXd& rows);

/// Square roots of the covariances of all stages' states by all measurements. That part of them that is about the
/// constants is the same in all stages and kept once.
class CovarianceRoots {
 public:
  CovarianceRoots(const SmootherResult& result, const std::vector<SmootherStage>& stages);

  /// Root of the covariance of what depends so on the states of a stage: rows · root of the stage.
  [[nodiscard]] Eigen::MatrixXd spread(std::size_t stage, const Eigen::MatrixXd& rows) const;

 private:
  Eigen::MatrixXd constants_;             ///< c × c; no constant depends on the other columns
  std::vector<Eigen::MatrixXd> dynamic_;  ///< rows of the states that move, stage by stage
};

}  // namespace trihedron::ground
