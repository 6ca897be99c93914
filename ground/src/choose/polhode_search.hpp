#pragma once
/// The polhode of a rotor, by how its coefficients change during a pass.

#include <Eigen/Core>

#include "choose/pass_form.hpp"
#include "trihedron/core/setup.hpp"

namespace trihedron::ground {

/// A polhode over a span of time by its turns in it, and how the period changes over it, as a part of that in its
/// middle: what a pass tells of it one by one.
struct TurnsOfPolhode {
  double turns;
  double change;

  /// begin_s: of the span, since the angle was 0.
  [[nodiscard]] static TurnsOfPolhode of(const Polhode& polhode, double begin_s, double span_s);
  [[nodiscard]] Polhode polhode(double begin_s, double span_s) const;
};

/// The polhode of one rotor with which its coefficients most likely come and go.
struct LikelyPolhode {
  Polhode polhode;      ///< from the epoch of the pass on
  double log_odds = 0;  ///< ln of the Bayes factor against coefficients that stay, less ln of the number of tries
};

/// Looks for the polhode of each rotor, along the steps of its coefficients: first for the number of turns in the pass,
/// then for how the period changes as well.
class PolhodeSearch {
 public:
  /// `sigma`: prior of each amplitude, rad/s, gyro by gyro. Refers to `pass`.
  PolhodeSearch(const PassForm& pass, const PassProblem& problem, Eigen::VectorXd sigma);

  [[nodiscard]] LikelyPolhode of_gyro(int gyro) const;

 private:
  [[nodiscard]] double log_odds(int gyro, const TurnsOfPolhode& turns) const;

  const PassForm& pass_;
  Time zero_at_;
  double begin_s_;
  double span_s_;
  Eigen::VectorXd sigma_;
};

}  // namespace trihedron::ground
