#pragma once
/// Tests whether innovations are white.

#include <vector>

#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Over all components of the innovations of the first star tracker, each in its sigma.
struct Whiteness {
  /// Autocorrelation of fixes 1 … kLags apart: N Σ r² is χ² of these degrees of freedom where they are white.
  double correlation_square = 0;
  int degrees_of_freedom = 0;
  double largest_correlation = 0;
  /// Of the component with the most: by how much the variance of a mean of many is larger than if they were white.
  double variance_of_mean = 1;

  /// Of the component with the most, in its sigma: by how much fixes are off to one side and the other by turns.
  double alternation = 0;
  double alternation_sigma = 0;  ///< 1-sigma of that by chance

  /// At a multiple of the orbital rate. Twice the power is χ² of `degrees_of_freedom` where there is no line.
  struct Line {
    int multiple = 1;
    double power = 0;  ///< Σ |Σ z exp(−i n t)|² / N
    int degrees_of_freedom = 0;
    double amplitude = 0;  ///< of the strongest component, in its sigma
  };
  std::vector<Line> lines;

  static constexpr int kLags = 10;
};

[[nodiscard]] Whiteness whiteness(const std::vector<FixRecord>& fixes, double orbital_rate_rad_s);

}  // namespace trihedron::ground
