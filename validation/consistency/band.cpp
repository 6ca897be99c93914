#include "consistency/band.hpp"

#include <boost/math/distributions/chi_squared.hpp>

namespace trihedron::consistency {

Band band_of_mean(double freedom, long count) {
  const auto n = static_cast<double>(count);
  const boost::math::chi_squared sum(freedom * n);
  return {quantile(sum, 0.025) / n, quantile(sum, 0.975) / n};
}

}  // namespace trihedron::consistency
