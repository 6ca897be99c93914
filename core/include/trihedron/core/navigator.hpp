#pragma once
/// The open-loop navigator: between astro-corrections the momenta turn by the drift model alone, and they give the
/// attitude.

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/measurement.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/step_report.hpp"

namespace trihedron {

/// Momenta and parameters in use since the last astro-correction, and what is known of their errors. The estimate of
/// the Gauss–Markov drift decays with its correlation time; the variance of what replaces it is added.
template <class Estimator>
class Navigator {
 public:
  using Gyros = typename Estimator::Gyros;
  using Sensitivities = typename Estimator::Sensitivities;

  /// Momenta and parameters, and what has come to their errors since the correction.
  struct State {
    Gyros gyros;
    double time_s = 0;               ///< since the correction
    double extra_variance_rad2 = 0;  ///< of the directions, per axis
  };

  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] const Gyros& gyros() const { return state_.gyros; }
  [[nodiscard]] State& state() { return state_; }
  [[nodiscard]] const State& state() const { return state_; }

  /// What an instantaneous astro-correction takes over.
  struct Source {
    ParametersInUse parameters{};
    /// With the parameters held, those of the set-up or those in use: the attitude at which the held alignments read
    /// the directions (`h_b`). The errors are then those of the parameters held and of the attitude.
    AttitudeSolution attitude;
    Directions h_b;
  };
  /// The state that a correction makes: the estimator's, or the parameters held with directions of their own.
  [[nodiscard]] State corrected(const Estimator& estimator, const Source& source) const;
  /// Instantaneous astro-correction: `state` is corrected(), or what it has become since; the errors are those at the
  /// estimator's last fix. Nothing may have been asked of another correction between.
  void take_over(const Estimator& estimator, const Source& source, const State& state);

  /// Open-loop prediction of a state over one step that ends at t; C_in_c and h_b of its middle.
  static void predict(const Estimator& estimator, const Eigen::Matrix3d& C_in_c, const Directions& h_b, Time t,
                      double dt_s, State& state);

  /// Carries the errors over the stretch between two fixes, by the sensitivities that the estimator has integrated.
  void extend(const Estimator& estimator, const Sensitivities& stretch);

  /// Attitude by the momenta of a state and these readings, with the covariance of the present correction. Needs
  /// started().
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> attitude(const Estimator& estimator,
                                                                   const FixReadings& readings,
                                                                   const State& state) const;

 private:
  /// The sensitivities of the stretch after `since`, those since the correction.
  void append(const Estimator& estimator, const Sensitivities& stretch, Sensitivities& since) const;
  /// Storage of the errors, set to zero.
  [[nodiscard]] RowsView new_errors(int rows, int columns);
  /// The errors of a correction with the parameters held.
  void hold_errors(const Estimator& estimator, const Source& source, const Gyros& gyros);
  /// Whether the parameters held are those of the set-up.
  [[nodiscard]] bool are_of_set_up(const Source& source) const {
    return source.parameters == ParametersInUse::kOfSetUp || !started_;
  }

  State state_;
  /// Root of the covariance of the errors at the correction, rows as in error_layout(), one after the other.
  std::array<double, static_cast<std::size_t>(Estimator::kMaxErrors) * Estimator::kMaxStates> errors_{};
  int error_rows_ = 0;
  int error_columns_ = 0;
  Sensitivities since_correction_;
  double extended_until_s_ = 0;
  bool started_ = false;
};

}  // namespace trihedron
