#include "consistency/statistics.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "trihedron/ground/judge/agreement.hpp"
#include "trihedron/ground/observe/observe.hpp"

namespace trihedron::consistency {
namespace {

/// Scaled by the sigmas, which differ by ten orders of magnitude.
struct Scaled {
  explicit Scaled(const ParameterCovariance& covariance)
      : unit(covariance.diagonal().cwiseSqrt().cwiseInverse()),
        correlation(unit.asDiagonal() * covariance * unit.asDiagonal()) {}

  ParameterErrors unit;
  Eigen::LLT<ParameterCovariance> correlation;
};

}  // namespace

double nees(const ParameterErrors& errors, const ParameterCovariance& covariance) {
  const Scaled scaled(covariance);
  const ParameterErrors in_sigmas = errors.cwiseProduct(scaled.unit);
  return in_sigmas.dot(scaled.correlation.solve(in_sigmas));
}

ParameterCovariance prior_covariance(const Scenario& scenario) {
  ParameterErrors variance;
  for (int k = 0; k < kGyros; ++k) {
    const GyroScenario& gyro = scenario.gyros[static_cast<std::size_t>(k)];
    variance.segment<Esg7::kSize>(Parameters::drift(k)).setConstant(std::pow(gyro.drift.prior_sigma_rad_s, 2));
    variance.segment<3>(Parameters::alignment(k)).setConstant(std::pow(gyro.alignment_prior_sigma_rad, 2));
  }
  return variance.asDiagonal();
}

Difference& Difference::operator+=(const Difference& other) {
  square += other.square;
  variance_ratio += other.variance_ratio;
  return *this;
}

Difference& Difference::operator/=(double count) {
  square /= count;
  variance_ratio /= count;
  return *this;
}

Nees observable_nees(const ParameterErrors& errors, const ParameterCovariance& covariance,
                     const ParameterCovariance& prior) {
  // Of a combination with ratio s the covariance by both is 1/(1 + s²) of the prior's.
  const double share = 1 / (1 + std::pow(ground::Observability::kUnobservable, 2));
  const ground::Agreement known = ground::agreement_within(errors, covariance, share * prior);
  return {known.chi_square, static_cast<double>(known.degrees_of_freedom)};
}

Difference difference_by_parameter(const ParameterErrors& difference, const ParameterCovariance& first,
                                   const ParameterCovariance& second) {
  const ParameterErrors variance = second.diagonal();
  return {difference.cwiseAbs2().cwiseQuotient(variance).mean(), first.diagonal().cwiseQuotient(variance).mean()};
}

Difference difference_by_combination(const ParameterErrors& difference, const ParameterCovariance& first,
                                     const ParameterCovariance& second) {
  const Scaled scaled(second);
  const ParameterCovariance first_scaled = scaled.unit.asDiagonal() * first * scaled.unit.asDiagonal();
  return {nees(difference, second) / Parameters::kSize,
          scaled.correlation.solve(first_scaled).trace() / Parameters::kSize};
}

bool agrees(const Difference& difference) {
  constexpr double kBeside = 1.0 / 3;
  return difference.square <= kBeside * kBeside + std::max(difference.variance_ratio - 1, 0.0);
}

}  // namespace trihedron::consistency
