#include "trihedron/core/paper_estimator.hpp"

#include <cmath>

#include "trihedron/core/cycle.hpp"
#include "trihedron/core/innovation.hpp"

namespace trihedron {

template <class Model>
Result<PaperEstimator<Model>, SetupFault> PaperEstimator<Model>::create(const Setup& setup) {
  if (const auto fault = setup.fault()) {
    return *fault;
  }
  const auto root = information_root<Layout::kParameters>(setup.prior_covariance);
  if (!root) {
    return root.fault();
  }
  PaperEstimator estimator;
  estimator.setup_ = setup;
  estimator.gyros_ = setup.prior;
  estimator.gate_ = OutlierGate(setup);
  estimator.prior_.add_prior_of_constants(root.value());
  estimator.information_ = estimator.prior_;
  return estimator;
}

template <class Model>
auto PaperEstimator<Model>::quasi_inertial(const Trihedron<In>& t) -> QuasiInertial {
  QuasiInertial qi;
  qi.components[0] << t.q1().transpose(), t.q3().transpose();
  qi.tangents[0] << t.q1(), t.q3();
  // Gyro 2 lies in the plane of q2 and q3; its errors across itself have −cotθ in component 3 for 1 in component 2.
  qi.components[1] << t.q1().transpose(), t.q2().transpose();
  qi.tangents[1] << t.q1(), t.q2() - t.cosine / t.sine * t.q3();
  qi.sine = t.sine;
  return qi;
}

template <class Model>
void PaperEstimator<Model>::predict(const Eigen::Matrix3d& C_in_c, const Directions& h_b, double dt_s) {
  for (int k = 0; k < kGyros; ++k) {
    precess(gyros_[k], since_fix_[k], C_in_c, h_b[k], dt_s);
  }
  time_since_fix_s_ += dt_s;
  gate_.elapse(dt_s);
}

template <class Model>
void PaperEstimator<Model>::update_covariance_to_now(const QuasiInertial& now) {
  // Δh = φ × h carries the sensitivities, which are in φ, to the paper's components.
  typename Information::DynamicMatrix by_start = Information::DynamicMatrix::Zero();
  typename Information::DynamicByConstants by_parameters = Information::DynamicByConstants::Zero();
  for (int k = 0; k < kGyros; ++k) {
    const Eigen::Matrix3d cross_h = skew<double>(gyros_[k].h_in);
    const Eigen::Matrix<double, 2, 3> components_of_phi = -now.components[k] * cross_h;
    const Eigen::Vector3d h_before = since_fix_[k].by_start.transpose() * gyros_[k].h_in;
    const int row = Layout::direction(k);
    by_start.template block<2, 2>(row, row) =
        components_of_phi * since_fix_[k].by_start * skew<double>(h_before) * qi_.tangents[k];
    by_parameters.template block<2, Model::kSize>(row, Layout::drift(k) - Layout::kDynamic) =
        components_of_phi * since_fix_[k].by_drift;
    by_parameters.template block<2, 3>(row, Layout::alignment(k) - Layout::kDynamic) =
        components_of_phi * since_fix_[k].by_alignment;
  }
  const double walk = setup_.direction_random_walk_rad_sqrt_s;
  const double sigma = std::sqrt(walk * walk * time_since_fix_s_ + extra_variance_rad2_);
  // Component 2 of gyro 2 sees sinθ of an isotropic error across h2.
  const Eigen::Vector4d noise(sigma, sigma, sigma, sigma * now.sine);
  information_.propagate(by_start.inverse(), by_parameters, noise);
  qi_ = now;
  since_fix_ = {};
  time_since_fix_s_ = 0;
  extra_variance_rad2_ = 0;
}

template <class Model>
auto PaperEstimator<Model>::measure(const Gyros& gyros, const QuasiInertial& qi, const Eigen::Matrix3d& C_in_c,
                                    const Directions& h_b, const Setup& setup) -> Measurement {
  // y = Δh − (C_in_c δ) × h + noise
  Measurement measurement;
  Eigen::Matrix<double, kMeasurements, 3 + 3 * kGyros> noise =
      Eigen::Matrix<double, kMeasurements, 3 + 3 * kGyros>::Zero();
  for (int k = 0; k < kGyros; ++k) {
    const int row = Layout::direction(k);
    const Eigen::Vector3d reference_in = C_in_c * (gyros[k].C_c_b * h_b[k]);
    const Eigen::Matrix<double, 2, 3> cross_h = qi.components[k] * skew<double>(reference_in);
    measurement.innovation.template segment<2>(row) = qi.components[k] * (reference_in - gyros[k].h_in);
    measurement.H.template block<2, 2>(row, row).setIdentity();
    measurement.H.template block<2, 3>(row, Layout::alignment(k)) = cross_h * C_in_c;
    noise.template block<2, 3>(row, 0) = cross_h * C_in_c * setup.star_tracker_noise_rad.asDiagonal();
    noise.template block<2, 3>(row, 3 + 3 * k) = setup.readout_noise_rad[k] * cross_h;
  }
  measurement.R = noise * noise.transpose();
  return measurement;
}

template <class Model>
auto PaperEstimator<Model>::correct(const Eigen::Matrix3d& C_in_c, const Directions& h_b) -> Report {
  Report report;
  if (!started_) {
    for (int k = 0; k < kGyros; ++k) {
      gyros_[k].h_in = C_in_c * (gyros_[k].C_c_b * h_b[k]);
    }
  }
  const auto trihedron = make_trihedron(Vec<In>::assume(gyros_[0].h_in), Vec<In>::assume(gyros_[1].h_in));
  if (!trihedron) {
    report.status = FixStatus::kRejectedGeometry;
    return report;
  }
  const QuasiInertial now = quasi_inertial(trihedron.value());
  if (started_) {
    update_covariance_to_now(now);
  } else {
    qi_ = now;
  }
  const Measurement measurement = measure(gyros_, now, C_in_c, h_b, setup_);
  const auto white = whitened<Information, kMeasurements>(measurement.H, measurement.innovation, measurement.R);

  if (!started_) {
    information_.add_information(white.H);
    started_ = true;
    report.status = FixStatus::kStarted;
    return report;
  }

  report_innovation(information_, white, report);
  report.status = gate_.judge(report.nis, measurement.innovation.norm());
  report.rejections_in_a_row = gate_.rejections_in_a_row();
  report.jumped = gate_.jumped();
  report.weight = student_t_weight(setup_.student_t_freedom, report.nis, kMeasurements);
  switch (report.status) {
    case FixStatus::kRejectedByGate:
      if (!(report.weight < 1) || report.jumped) {
        return report;
      }
      report.status = FixStatus::kUsed;
      break;
    case FixStatus::kRestarted:
      // Information gathered about a far wrong estimate: linearise anew about the present one.
      information_ = prior_;
      report.weight = 1;
      break;
    case FixStatus::kUsedAfterReopening:
      add_direction_variance(measurement.innovation.squaredNorm() / kMeasurements);
      update_covariance_to_now(now);
      report.weight = 1;
      break;
    default:
      break;
  }
  const double root_weight = std::sqrt(report.weight);
  feed_back(information_.template update<kMeasurements>(root_weight * white.H, root_weight * white.y));
  return report;
}

template <class Model>
void PaperEstimator<Model>::feed_back(const typename Information::Vector& correction) {
  for (int k = 0; k < kGyros; ++k) {
    GyroModel<Model>& gyro = gyros_[k];
    const Eigen::Vector3d direction_error = qi_.tangents[k] * correction.template segment<2>(Layout::direction(k));
    const Eigen::Vector3d alignment_error = correction.template segment<3>(Layout::alignment(k));
    gyro.h_in = rotated<double>(gyro.h_in, gyro.h_in.cross(direction_error)).normalized();
    gyro.drift_rad_s += correction.template segment<Model::kSize>(Layout::drift(k));
    // Through the quaternion, so that rounding cannot pile up in the matrix over months of fixes.
    gyro.C_c_b = Eigen::Quaterniond(Rot<C, C>::exp(Vec<C>::assume(alignment_error)).raw() * gyro.C_c_b)
                     .normalized()
                     .toRotationMatrix();
  }
}

template <class Model>
auto PaperEstimator<Model>::error_root() const -> ErrorRoot {
  const typename Information::Matrix root = information_.inverse_root();
  ErrorRoot errors;
  for (int k = 0; k < kGyros; ++k) {
    errors.template middleRows<3>(Errors::direction(k)) =
        skew<double>(gyros_[k].h_in) * qi_.tangents[k] * root.template middleRows<2>(Layout::direction(k));
  }
  errors.template bottomRows<Layout::kParameters>() = root.template bottomRows<Layout::kParameters>();
  return errors;
}

template <class Model>
auto PaperEstimator<Model>::through_uncertainty(const Eigen::Matrix<double, 3, Errors::kSize>& by_errors) const
    -> Eigen::Matrix<double, 3, Layout::kStates> {
  Eigen::Matrix<double, 3, Layout::kStates> by_states;
  for (int k = 0; k < kGyros; ++k) {
    by_states.template middleCols<2>(Layout::direction(k)) =
        by_errors.template middleCols<3>(Errors::direction(k)) * skew<double>(gyros_[k].h_in) * qi_.tangents[k];
  }
  by_states.template rightCols<Layout::kParameters>() = by_errors.template rightCols<Layout::kParameters>();
  return information_.template through_uncertainty<3>(by_states);
}

template class PaperEstimator<Esg7>;
template class Cycle<PaperEstimator<Esg7>>;

}  // namespace trihedron
