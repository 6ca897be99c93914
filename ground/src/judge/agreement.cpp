#include "trihedron/ground/judge/agreement.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <iterator>

#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

Agreement agreement_of(double chi_square, int degrees_of_freedom, double sure = 0.999) {
  Agreement result{chi_square, degrees_of_freedom, 0};
  if (degrees_of_freedom > 0) {
    result.limit = boost::math::quantile(boost::math::chi_squared(degrees_of_freedom), sure);
  }
  return result;
}

Rot<C, B<1>> C_c_b(const Calibration& calibration, std::size_t gyro) {
  return Rot<C, B<1>>::exp(Vec<C>::assume(calibration.gyros[gyro].alignment_rotation_vector_rad));
}

}  // namespace

std::string Agreement::text() const {
  // To two digits: rounding alone moves it by a percent where axes of the covariance differ by a factor of a million.
  return degrees_of_freedom == 0
             ? "nothing that both determine"
             : fmt::format("chi-square {:.2g} of {} degrees of freedom; 99.9 % of agreeing ones lie below {:.3g}",
                           chi_square, degrees_of_freedom, limit);
}

Agreement agreement(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance, double sure) {
  return agreement_of(difference.dot(covariance.llt().solve(difference)), static_cast<int>(difference.size()), sure);
}

Agreement agreement_within(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance,
                           const Eigen::MatrixXd& scale) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> directions(covariance, scale);
  double chi_square = 0;
  int known = 0;
  for (Eigen::Index i = 0; i < difference.size(); ++i) {
    const double variance = directions.eigenvalues()(i);
    if (variance < 1) {
      const double along = directions.eigenvectors().col(i).dot(difference);
      chi_square += along * along / variance;
      ++known;
    }
  }
  return agreement_of(chi_square, known);
}

// In the axes in which the prior is 1 and the posterior λ, the estimate lies between the prior and what the data say,
// and differs from the prior with the variance 1 − λ. A prior off by b moves it by √λ b of its sigmas.
Agreement agreement_with_prior(const Eigen::VectorXd& difference, const Eigen::MatrixXd& prior,
                               const Eigen::MatrixXd& posterior, double sure) {
  constexpr double kPriorTells = 0.02;
  constexpr double kDataTell = 0.8;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> directions(posterior, prior);
  double chi_square = 0;
  int known = 0;
  for (Eigen::Index i = 0; i < difference.size(); ++i) {
    const double left = directions.eigenvalues()(i);
    if (left > kPriorTells && left < kDataTell) {
      const double along = directions.eigenvectors().col(i).dot(difference);
      chi_square += along * along / (1 - left);
      ++known;
    }
  }
  return agreement_of(chi_square, known, sure);
}

std::vector<ParameterId> common_states(const Calibration& a, const Calibration& b, bool alignments) {
  std::vector<ParameterId> common;
  std::ranges::copy_if(a.states, std::back_inserter(common), [&](const ParameterId& state) {
    return (alignments ? state.is_alignment() : state.is_drift()) &&
           std::ranges::find(b.states, state) != b.states.end();
  });
  return common;
}

Eigen::VectorXd difference(const Calibration& from, const Calibration& to, const std::vector<ParameterId>& states) {
  Eigen::VectorXd result(static_cast<Eigen::Index>(states.size()));
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    const ParameterId& state = states[static_cast<std::size_t>(i)];
    result(i) = state.is_alignment()
                    ? (C_c_b(to, state.gyro()) * C_c_b(from, state.gyro()).inverse()).log().raw()(state.component)
                    : value_of(to, state) - value_of(from, state);
  }
  return result;
}

}  // namespace trihedron::ground
