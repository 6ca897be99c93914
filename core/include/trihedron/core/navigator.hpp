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

/// The gyro trihedron as believed in `in` and as read in the cases (paper: reference gyro 1, Fig. 4).
struct TrihedronPair {
  Trihedron<In> in;
  Trihedron<C> c;
  [[nodiscard]] Rot<In, C> C_in_c() const { return attitude(in, c); }
};

/// h_b: direction cosines, need not be exactly unit.
template <class Model>
[[nodiscard]] Result<TrihedronPair, DirectionsFault> make_trihedra(const PerGyro<GyroModel<Model>, 2>& gyros,
                                                                   const PerGyro<Eigen::Vector3d, 2>& h_b) {
  const auto in = make_trihedron(Vec<In>::assume(gyros[0].h_in), Vec<In>::assume(gyros[1].h_in));
  if (!in) {
    return in.fault();
  }
  const auto c = make_trihedron(Vec<C>::assume(gyros[0].C_c_b * h_b[0]), Vec<C>::assume(gyros[1].C_c_b * h_b[1]));
  if (!c) {
    return c.fault();
  }
  return TrihedronPair{in.value(), c.value()};
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
  const auto trihedra = make_trihedra(gyros, h_b);
  if (!trihedra) {
    return trihedra.fault();
  }
  AttitudeSolution solution;
  solution.C_in_c = trihedra.value().C_in_c();
  const Eigen::Matrix3d C_c_in = solution.C_in_c.raw().transpose();
  const Eigen::Matrix<double, 3, 6> by_directions = attitude_by_directions(trihedra.value().c);
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

  /// Instantaneous astro-correction: takes over the estimator's directions and parameters.
  void correct(const Estimator& estimator) {
    gyros_ = estimator.gyros();
    errors_ = estimator.error_root();
    restart_clock();
  }

  /// Instantaneous astro-correction with the parameters of the set-up held: the directions are those that the held
  /// alignments read at this attitude (`h_b`), and the errors those of the set-up and of the attitude.
  void correct_directions(const Estimator& estimator, const AttitudeSolution& attitude,
                          const typename Estimator::Directions& h_b) {
    using Errors = typename Estimator::Errors;
    constexpr int kParameters = Estimator::Setup::Layout::kSize;
    static_assert(Estimator::ErrorRoot::ColsAtCompileTime >= kParameters + 3);
    if (!started_) {
      gyros_ = estimator.setup().prior;
    }
    const Eigen::Matrix3d& C_in_c = attitude.C_in_c.raw();
    errors_.setZero();
    errors_.template block<kParameters, kParameters>(Errors::kDirections, 0) =
        estimator.setup().prior_covariance.llt().matrixL();
    const Eigen::Matrix3d attitude_root = attitude.covariance_rad2.llt().matrixL();
    for (int k = 0; k < gyros_.size(); ++k) {
      gyros_[k].h_in = (C_in_c * (gyros_[k].C_c_b * h_b[k])).normalized();
      // φ = C_in_c (δ + ε): h_in was read through the held alignment at the estimated attitude.
      errors_.template middleRows<3>(Errors::direction(k)) =
          C_in_c * errors_.template middleRows<3>(Errors::alignment(k));
      errors_.template block<3, 3>(Errors::direction(k), kParameters) = C_in_c * attitude_root;
    }
    restart_clock();
  }

  /// Open-loop prediction over one step; C_in_c and h_b of its middle. Needs started().
  void predict(const Eigen::Matrix3d& C_in_c, const typename Estimator::Directions& h_b, double dt_s) {
    for (int k = 0; k < gyros_.size(); ++k) {
      precess(gyros_[k], C_in_c, h_b[k], dt_s);
    }
    time_since_correction_s_ += dt_s;
  }

  /// Widens the directions: `variance_rad2` per axis, as the estimator's.
  void add_direction_variance(double variance_rad2) { extra_variance_rad2_ += variance_rad2; }

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
                                     walk * walk * time_since_correction_s_ + extra_variance_rad2_);
  }

 private:
  void restart_clock() {
    since_correction_ = {};
    time_since_correction_s_ = 0;
    extra_variance_rad2_ = 0;
    started_ = true;
  }

  typename Estimator::Gyros gyros_;
  typename Estimator::ErrorRoot errors_ = Estimator::ErrorRoot::Zero();
  typename Estimator::Sensitivities since_correction_;
  double time_since_correction_s_ = 0;
  double extra_variance_rad2_ = 0;
  bool started_ = false;
};

}  // namespace trihedron
