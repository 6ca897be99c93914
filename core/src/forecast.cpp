#include "trihedron/core/forecast.hpp"

#include <cmath>
#include <limits>

namespace trihedron {

double error_997_rad(const Eigen::Matrix3d& covariance_rad2) {
  const double mean = covariance_rad2.trace();
  const double half_variance = covariance_rad2.squaredNorm();
  if (!(mean > 0)) {
    return mean == 0 ? 0 : std::numeric_limits<double>::infinity();
  }
  constexpr double kSigmas = 2.7478;  // of a normal variable, one-sided
  const double freedom = mean * mean / half_variance;
  const double variance = 2 / (9 * freedom);
  const double root = 1 - variance + kSigmas * std::sqrt(variance);
  return std::sqrt(mean * root * root * root);
}

}  // namespace trihedron
