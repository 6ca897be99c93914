#include "trihedron/core/forecast.hpp"

#include <cmath>
#include <limits>

namespace trihedron {

double error_quantile_rad(const Eigen::Matrix3d& covariance_rad2, double normal) {
  const double mean = covariance_rad2.trace();
  const double half_variance = covariance_rad2.squaredNorm();
  if (!(mean > 0)) {
    return mean == 0 ? 0 : std::numeric_limits<double>::infinity();
  }
  const double freedom = mean * mean / half_variance;
  const double variance = 2 / (9 * freedom);
  const double root = 1 - variance + normal * std::sqrt(variance);
  return std::sqrt(mean * root * root * root);
}

}  // namespace trihedron
