#pragma once
/// The open-loop navigator: between astro-corrections the momenta turn by the drift model alone, and they give the
/// attitude.

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/measurement.hpp"
#include "trihedron/core/optimal_attitude.hpp"

namespace trihedron {

/// Momenta and parameters in use since the last astro-correction, and what is known of their errors. The estimate of
/// the Gauss–Markov drift decays with its correlation time; the variance of what replaces it is added.
template <class Estimator>
class Navigator {
 public:
  using Gyros = typename Estimator::Gyros;
  using Sensitivities = typename Estimator::Sensitivities;

  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] const Gyros& gyros() const { return gyros_; }

  /// Instantaneous astro-correction: takes over the estimator's directions and parameters.
  void correct(const Estimator& estimator);

  /// Instantaneous astro-correction with the parameters held, those of the set-up or those in use: the directions are
  /// those that the held alignments read at this attitude (`h_b`), and the errors those of the parameters held and of
  /// the attitude.
  void correct_directions(const Estimator& estimator, const AttitudeSolution& attitude, const Directions& h_b,
                          bool of_set_up);

  /// Open-loop prediction over one step that ends at t; C_in_c and h_b of its middle. Needs started().
  void predict(const Estimator& estimator, const Eigen::Matrix3d& C_in_c, const Directions& h_b, Time t, double dt_s);

  /// Widens the directions: `variance_rad2` per axis, as the estimator's.
  void add_direction_variance(double variance_rad2) { extra_variance_rad2_ += variance_rad2; }

  /// Carries the errors over the stretch between two fixes, by the sensitivities that the estimator has integrated.
  void extend(const Estimator& estimator, const Sensitivities& stretch);

  /// Attitude by the momenta and these readings, with its covariance. Needs started().
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> attitude(const Estimator& estimator,
                                                                   const FixReadings& readings) const {
    return attitude(estimator, gyros_, readings, time_since_correction_s_);
  }

  /// The same `back_s` before the present, which has `t` and to which C_in_c and h_b are the middle of the step.
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> attitude_before(const Estimator& estimator,
                                                                          const FixReadings& readings,
                                                                          const Eigen::Matrix3d& C_in_c,
                                                                          const Directions& h_b, Time t,
                                                                          double back_s) const;

 private:
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> attitude(const Estimator& estimator, const Gyros& gyros,
                                                                   const FixReadings& readings,
                                                                   double time_since_correction_s) const;
  void precess_all(const Estimator& estimator, const Eigen::Matrix3d& C_in_c, const Directions& h_b, Time t,
                   double dt_s, Gyros& gyros) const;
  /// The sensitivities of the stretch after `since`, those since the correction.
  void append(const Estimator& estimator, const Sensitivities& stretch, Sensitivities& since) const;
  /// Storage of the errors, set to zero.
  [[nodiscard]] RowsView new_errors(int rows, int columns);
  void restart_clock(const Layout& layout);

  Gyros gyros_;
  /// Root of the covariance of the errors at the correction, rows as in error_layout(), one after the other.
  std::array<double, static_cast<std::size_t>(Estimator::kMaxErrors) * Estimator::kMaxStates> errors_{};
  int error_rows_ = 0;
  int error_columns_ = 0;
  Sensitivities since_correction_;
  double time_since_correction_s_ = 0;
  double extended_until_s_ = 0;
  double extra_variance_rad2_ = 0;
  bool started_ = false;
};

}  // namespace trihedron
