#pragma once
/// The open-loop navigator: between astro-corrections the momenta turn by the drift model alone, and they give the
/// attitude.

#include "trihedron/core/calibration.hpp"
#include "trihedron/core/per_gyro.hpp"

namespace trihedron {

/// Attitude with the covariance of its error ε in c axes, rad²: true C_in_c = est · exp([ε×]).
struct AttitudeSolution {
  Rot<In, C> C_in_c;
  Eigen::Matrix3d covariance_rad2 = Eigen::Matrix3d::Zero();
};

/// C_in_c by the trihedra on the momenta believed in `in` and read in the cases (paper: reference gyro 1, Fig. 4).
/// `in_c` is filled for callers that need θ. h_b: direction cosines, need not be exactly unit.
template <class Model>
[[nodiscard]] Result<Rot<In, C>, DirectionsFault> trihedron_attitude(const PerGyro<GyroModel<Model>, 2>& gyros,
                                                                     const PerGyro<Eigen::Vector3d, 2>& h_b) {
  const auto in = make_trihedron(Vec<In>::assume(gyros[0].h_in), Vec<In>::assume(gyros[1].h_in));
  if (!in) {
    return in.fault();
  }
  const auto c = make_trihedron(Vec<C>::assume(gyros[0].C_c_b * h_b[0]), Vec<C>::assume(gyros[1].C_c_b * h_b[1]));
  if (!c) {
    return c.fault();
  }
  return attitude(in.value(), c.value());
}

/// Attitude with its covariance: errors at a reference epoch (rows of `errors` as in ErrorLayout), carried by `since`,
/// plus the readout noise of this sample and a random walk of the directions of `walk_variance_rad2` per axis.
template <class Model, int Columns>
[[nodiscard]] Result<AttitudeSolution, DirectionsFault> trihedron_attitude(
    const PerGyro<GyroModel<Model>, 2>& gyros, const PerGyro<Eigen::Vector3d, 2>& h_b,
    const Eigen::Matrix<double, ErrorLayout<Model, 2>::kSize, Columns>& errors,
    const PerGyro<Sensitivity<Model>, 2>& since, const PerGyro<double, 2>& readout_noise_rad,
    double walk_variance_rad2) {
  using Errors = ErrorLayout<Model, 2>;
  const auto in = make_trihedron(Vec<In>::assume(gyros[0].h_in), Vec<In>::assume(gyros[1].h_in));
  if (!in) {
    return in.fault();
  }
  const auto c = make_trihedron(Vec<C>::assume(gyros[0].C_c_b * h_b[0]), Vec<C>::assume(gyros[1].C_c_b * h_b[1]));
  if (!c) {
    return c.fault();
  }
  AttitudeSolution solution;
  solution.C_in_c = attitude(in.value(), c.value());
  const Eigen::Matrix3d C_c_in = solution.C_in_c.raw().transpose();
  const Eigen::Matrix<double, 3, 6> by_directions = attitude_by_directions(c.value());
  Eigen::Matrix<double, 3, Errors::kSize> by_errors = Eigen::Matrix<double, 3, Errors::kSize>::Zero();
  for (int k = 0; k < 2; ++k) {
    const Eigen::Matrix3d by_phi = by_directions.middleCols<3>(Errors::direction(k));
    const Eigen::Matrix3d by_phi_in = by_phi * C_c_in;
    by_errors.template middleCols<3>(Errors::direction(k)) = by_phi_in * since[k].by_start;
    by_errors.template middleCols<Model::kSize>(Errors::drift(k)) = by_phi_in * since[k].by_drift;
    by_errors.template middleCols<3>(Errors::alignment(k)) = by_phi_in * since[k].by_alignment - by_phi;
    const double white = readout_noise_rad[k] * readout_noise_rad[k] + walk_variance_rad2;
    solution.covariance_rad2 += white * by_phi * by_phi.transpose();
  }
  const Eigen::Matrix<double, 3, Columns> spread = by_errors * errors;
  solution.covariance_rad2 += spread * spread.transpose();
  return solution;
}

/// Momenta and parameters in use since the last astro-correction, and what is known of their errors.
template <class Estimator>
class Navigator {
 public:
  using Model = typename Estimator::DriftModel;

  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] const typename Estimator::Gyros& gyros() const { return gyros_; }

  /// Instantaneous astro-correction: takes over the estimator's directions and, where told or at the start, its
  /// parameters.
  void correct(const Estimator& estimator, bool take_parameters) {
    for (int k = 0; k < gyros_.size(); ++k) {
      if (take_parameters || !started_) {
        gyros_[k] = estimator.gyros()[k];
      } else {
        gyros_[k].h_in = estimator.gyros()[k].h_in;
      }
    }
    errors_ = estimator.error_root();
    since_correction_ = {};
    time_since_correction_s_ = 0;
    started_ = true;
  }

  /// Open-loop prediction over one step; C_in_c and h_b of its middle. Needs started().
  void predict(const Eigen::Matrix3d& C_in_c, const typename Estimator::Directions& h_b, double dt_s) {
    for (int k = 0; k < gyros_.size(); ++k) {
      precess(gyros_[k], C_in_c, h_b[k], dt_s);
    }
    time_since_correction_s_ += dt_s;
  }

  /// Carries the errors over the stretch between two fixes, for which the estimator has integrated the sensitivities.
  void extend(const typename Estimator::Sensitivities& stretch) {
    for (int k = 0; k < gyros_.size(); ++k) {
      since_correction_[k] = since_correction_[k].then(stretch[k]);
    }
  }

  /// Attitude at readings h_b; `since_fix`: the stretch not yet given to extend(). Needs started().
  [[nodiscard]] Result<AttitudeSolution, DirectionsFault> attitude_with_covariance(
      const typename Estimator::Directions& h_b, const typename Estimator::Sensitivities& since_fix,
      const typename Estimator::Setup& setup) const {
    typename Estimator::Sensitivities since = since_correction_;
    for (int k = 0; k < gyros_.size(); ++k) {
      since[k] = since[k].then(since_fix[k]);
    }
    const double walk = setup.direction_random_walk_rad_sqrt_s;
    return trihedron_attitude<Model>(gyros_, h_b, errors_, since, setup.readout_noise_rad,
                                     walk * walk * time_since_correction_s_);
  }

 private:
  typename Estimator::Gyros gyros_;
  typename Estimator::ErrorRoot errors_ = Estimator::ErrorRoot::Zero();
  typename Estimator::Sensitivities since_correction_;
  double time_since_correction_s_ = 0;
  bool started_ = false;
};

}  // namespace trihedron
