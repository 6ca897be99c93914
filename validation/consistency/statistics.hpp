#pragma once

#include <Eigen/Core>

#include "consistency/bound.hpp"
#include "trihedron/records/scenario.hpp"

namespace trihedron::consistency {

/// One per parameter, rad/s and rad (c axes).
using ParameterErrors = Eigen::Matrix<double, Parameters::kSize, 1>;

/// eᵀP⁻¹e over some combinations of the parameters.
struct Nees {
  double value = 0;
  double freedom = 0;  ///< how many combinations
};

/// Of all parameters.
[[nodiscard]] double nees(const ParameterErrors& errors, const ParameterCovariance& covariance);

/// Of the parameters of two gyros before a flight.
[[nodiscard]] ParameterCovariance prior_covariance(const Scenario& scenario);

/// Over the combinations that the flight made observable: prior sigma over that by the measurements alone above
/// ground::Observability::kUnobservable. Both covariances positive definite; `prior` is what `covariance` came from.
[[nodiscard]] Nees observable_nees(const ParameterErrors& errors, const ParameterCovariance& covariance,
                                   const ParameterCovariance& prior);

/// How two estimates of the same parameters differ, in sigmas of the second.
struct Difference {
  double square = 0;          ///< mean of the squared difference
  double variance_ratio = 0;  ///< mean of the variance of the first

  Difference& operator+=(const Difference& other);
  Difference& operator/=(double count);
};

/// Means over the parameters, one by one. `difference`: first less second.
[[nodiscard]] Difference difference_by_parameter(const ParameterErrors& difference, const ParameterCovariance& first,
                                                 const ParameterCovariance& second);

/// Means over as many combinations that are independent in the second estimate; which ones does not matter.
[[nodiscard]] Difference difference_by_combination(const ParameterErrors& difference, const ParameterCovariance& first,
                                                   const ParameterCovariance& second);

/// Whether the difference is explained by the larger covariance of the first, with a tolerance of a third of a sigma,
/// which makes its errors larger by 5 %.
[[nodiscard]] bool agrees(const Difference& difference);

}  // namespace trihedron::consistency
