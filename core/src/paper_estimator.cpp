#include "trihedron/core/paper_estimator.hpp"

#include <algorithm>
#include <cmath>

#include "trihedron/core/cholesky.hpp"

namespace trihedron {

std::optional<SetupFault> PaperEstimator::set_up(const CalibrationSetup& setup, const Gyros& prior,
                                                 const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  if (!(setup.layout == Layout{})) {
    return SetupFault::kTooLarge;
  }
  if (const auto fault = setup.fault()) {
    return fault;
  }
  if (!means_are_usable(prior, setup.layout)) {
    return SetupFault::kPriorMeanNotUsable;
  }
  constexpr int kFirst = States::kDynamic;
  constexpr int kParameters = States::kSize - kFirst;
  Errors errors;
  errors.reset(States::kSize);
  const RowsView S = errors.root();
  if (!covariance_root(covariance, {&S(kFirst, kFirst), kParameters, kParameters, S.stride})) {
    return SetupFault::kPriorNotPositiveDefinite;
  }
  setup_ = setup;
  drift_ = DriftModel(setup.layout.drift_model, setup.layout.further);
  prior_gyros_ = prior;
  prior_ = errors;
  forget();
  return std::nullopt;
}

void PaperEstimator::forget() {
  gyros_ = prior_gyros_;
  errors_ = prior_;
  gate_ = {};
  since_fix_.begin(Esg7::kSize);
  time_since_fix_s_ = 0;
  extra_variance_rad2_ = 0;
  started_ = false;
}

Result<AttitudeByDirections, DirectionsFault> PaperEstimator::attitude(const Gyros& gyros, const Directions& h_b,
                                                                       const GyroMask& used) {
  if (count(used) < kGyros) {
    return DirectionsFault::kTooFew;
  }
  return trihedron_attitude(momenta(gyros, kGyros), in_c(gyros, kGyros, h_b));
}

Result<Rot<In, C>, DirectionsFault> PaperEstimator::rotation(const Gyros& gyros, const Directions& h_b,
                                                             const GyroMask& used) {
  if (count(used) < kGyros) {
    return DirectionsFault::kTooFew;
  }
  return trihedron_rotation(momenta(gyros, kGyros), in_c(gyros, kGyros, h_b));
}

auto PaperEstimator::quasi_inertial(const Trihedron<In>& t) -> QuasiInertial {
  QuasiInertial qi;
  qi.components[0] << t.q1().transpose(), t.q3().transpose();
  qi.tangents[0] << t.q1(), t.q3();
  // Gyro 2 lies in the plane of q2 and q3; its errors across itself have −cotθ in component 3 for 1 in component 2.
  qi.components[1] << t.q1().transpose(), t.q2().transpose();
  qi.tangents[1] << t.q1(), t.q2() - t.cosine / t.sine * t.q3();
  qi.sine = t.sine;
  return qi;
}

void PaperEstimator::predict(const Eigen::Matrix3d& C_in_c, const Directions& h_b, Time /*t*/, double dt_s) {
  since_fix_.precess_all(
      gyros_, kGyros, drift_, C_in_c, h_b, [] { return DriftTimes{}; }, dt_s);
  time_since_fix_s_ += dt_s;
  gate_.elapse(dt_s);
}

void PaperEstimator::update_covariance_to_now(const QuasiInertial& now) {
  // Δh = φ × h carries the sensitivities, which are in φ, to the paper's components.
  Errors::DynamicByStates F = Errors::DynamicByStates::Zero(States::kDynamic, States::kSize);
  since_fix_.settle();
  const Sensitivities& since = since_fix_.all();
  for (int k = 0; k < kGyros; ++k) {
    const Eigen::Matrix3d cross_h = skew<double>(gyros_[k].h_in);
    const Eigen::Matrix<double, 2, 3> components_of_phi = -now.components[k] * cross_h;
    const Eigen::Vector3d h_before = since[k].by_start.transpose() * gyros_[k].h_in;
    const int row = States::direction(k);
    F.block<2, 2>(row, row) = components_of_phi * since[k].by_start * skew<double>(h_before) * qi_.tangents[k];
    F.block<2, Esg7::kSize>(row, States::drift(k)) =
        components_of_phi.lazyProduct(since[k].by_drift.first(Esg7::kSize));
    F.block<2, 3>(row, States::alignment(k)) = components_of_phi * since[k].by_alignment;
  }
  const double walk = setup_.direction_random_walk_rad_sqrt_s;
  const double sigma = std::sqrt(walk * walk * time_since_fix_s_ + extra_variance_rad2_);
  // Component 2 of gyro 2 sees sinθ of an isotropic error across h2.
  const Eigen::Vector4d noise(sigma, sigma, sigma, sigma * now.sine);
  errors_.propagate(rows_of(F), noise);
  qi_ = now;
  since_fix_.begin(Esg7::kSize);
  time_since_fix_s_ = 0;
  extra_variance_rad2_ = 0;
}

auto PaperEstimator::measure(const Gyros& gyros, const QuasiInertial& qi, const Eigen::Matrix3d& C_in_c,
                             const Directions& h_b, const CalibrationSetup& setup, const FixCovariance& covariance)
    -> Measurement {
  // y = Δh − (C_in_c δ) × h + noise
  Eigen::Matrix3d fix_root = setup.star_trackers[0].noise_rad.asDiagonal();
  if (covariance.is_told()) {
    fix_root = setup.over_told_covariance.asDiagonal() * cholesky_root<3>(covariance.matrix());
  }
  Measurement measurement;
  Eigen::Matrix<double, kMeasurements, 3 + 3 * kGyros> noise =
      Eigen::Matrix<double, kMeasurements, 3 + 3 * kGyros>::Zero();
  for (int k = 0; k < kGyros; ++k) {
    const int row = States::direction(k);
    const Eigen::Vector3d reference_in = C_in_c * (gyros[k].C_c_b * h_b[k]);
    const Eigen::Matrix<double, 2, 3> cross_h = qi.components[k] * skew<double>(reference_in);
    measurement.innovation.segment<2>(row) = qi.components[k] * (reference_in - gyros[k].h_in);
    measurement.H.block<2, 2>(row, row).setIdentity();
    measurement.H.block<2, 3>(row, States::alignment(k)) = cross_h * C_in_c;
    noise.block<2, 3>(row, 0) = cross_h * C_in_c * fix_root;
    noise.block<2, 3>(row, 3 + 3 * k) = setup.readout_noise_rad[k] * cross_h;
  }
  measurement.R = noise * noise.transpose();
  return measurement;
}

void PaperEstimator::report_innovation(const Measurement& measurement, const ComparedRows<kMaxStates>& seen,
                                       const ComponentCovariance& L, FixReport& report) {
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();
  add_square({seen.data(), kMeasurements, kMaxStates, kMaxStates + 1}, covariance.data(), kMeasurements);
  Eigen::Vector4d normalized = seen.col(kMaxStates);
  solve_lower(matrix_of(cholesky_root<kMeasurements>(covariance)), normalized);
  report.nis = normalized.squaredNorm();
  report.innovation = measurement.innovation;
  report.innovation_covariance = before_whitening(L, covariance);
}

FixReport PaperEstimator::correct(const StarFix& fix, const FixReadings& readings) {
  const FixReport report = take(fix, readings);
  if (!started_ || sound()) {
    return report;
  }
  forget();
  return lost(fix);
}

FixReport PaperEstimator::take(const StarFix& fix, const FixReadings& readings) {
  FixReport report;
  report.t = fix.t;
  report.head = fix.head;
  const Eigen::Matrix3d C_in_c = fix.q_in_c.normalized().toRotationMatrix();
  if (!started_) {
    started_ = start(C_in_c, readings.h_b, fix.covariance);
    report.status = started_ ? FixStatus::kStarted : FixStatus::kRejectedGeometry;
    return report;
  }
  const auto trihedron = make_trihedron(Vec<In>::assume(gyros_[0].h_in), Vec<In>::assume(gyros_[1].h_in));
  if (!trihedron) {
    report.status = FixStatus::kRejectedGeometry;
    return report;
  }
  const QuasiInertial now = quasi_inertial(trihedron.value());
  update_covariance_to_now(now);
  const Measurement measurement = measure(gyros_, now, C_in_c, readings.h_b, setup_, fix.covariance);
  ComponentCovariance L;
  ComparedRows<kMaxStates> rows = seen(measurement, L);
  report_innovation(measurement, rows, L, report);
  report.status = gate_.judge(setup_, report.nis, measurement.innovation.norm());
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
      // The information was gathered about estimates that are far off: linearise again about the present ones.
      report.status =
          start(C_in_c, readings.h_b, fix.covariance) ? FixStatus::kRestarted : FixStatus::kRejectedGeometry;
      report.weight = 1;
      return report;
    case FixStatus::kUsedAfterReopening:
      add_direction_variance(measurement.innovation.squaredNorm() / kMeasurements);
      update_covariance_to_now(now);
      rows = seen(measurement, L);
      report.weight = 1;
      break;
    default:
      break;
  }
  rows *= std::sqrt(report.weight);
  errors_.take(rows_of(rows));
  feed_back(errors_.correction());
  return report;
}

ComparedRows<PaperEstimator::kMaxStates> PaperEstimator::seen(const Measurement& measurement,
                                                              ComponentCovariance& L) const {
  ComparedRows<kMaxStates> rows(kMeasurements, kMaxStates + 1);
  rows << measurement.H, measurement.innovation;
  L = measurement.R;
  whiten(L, rows_of(rows));
  errors_.see_through_uncertainty(states_of(rows));
  return rows;
}

bool PaperEstimator::start(const Eigen::Matrix3d& C_in_c, const Directions& h_b, const FixCovariance& covariance) {
  const Eigen::Vector3d read_in[] = {C_in_c * (gyros_[0].C_c_b * h_b[0]), C_in_c * (gyros_[1].C_c_b * h_b[1])};
  const auto trihedron = make_trihedron(Vec<In>::assume(read_in[0]), Vec<In>::assume(read_in[1]));
  if (!trihedron) {
    return false;
  }
  for (int k = 0; k < kGyros; ++k) {
    gyros_[k].h_in = read_in[k].normalized();
  }
  qi_ = quasi_inertial(trihedron.value());
  const Measurement measurement = measure(gyros_, qi_, C_in_c, h_b, setup_, covariance);
  Errors::DynamicByStates F = -measurement.H;
  F.leftCols<States::kDynamic>().setZero();
  errors_ = prior_;
  errors_.begin(rows_of(F), measurement.R);
  return true;
}

void PaperEstimator::feed_back(const Errors::Vector& correction) {
  for (int k = 0; k < kGyros; ++k) {
    Gyro& gyro = gyros_[k];
    const Eigen::Vector3d direction_error = qi_.tangents[k] * correction.segment<2>(States::direction(k));
    const Eigen::Vector3d alignment_error = correction.segment<3>(States::alignment(k));
    gyro.h_in = rotated<double>(gyro.h_in, gyro.h_in.cross(direction_error)).normalized();
    gyro.drift_rad_s += correction.segment<Esg7::kSize>(States::drift(k));
    gyro.C_c_b = turned(gyro.C_c_b, alignment_error);
  }
}

void PaperEstimator::error_root(RowsView root) const {
  Eigen::Matrix<double, kMaxStates, kMaxStates, Eigen::RowMajor> S;
  errors_.put_root(rows_of(S));
  const Layout errors = error_layout();
  Eigen::Matrix<double, kMaxErrors, kMaxStates, Eigen::RowMajor> rows;
  for (int k = 0; k < kGyros; ++k) {
    rows.middleRows<3>(errors.direction(k)) =
        skew<double>(gyros_[k].h_in) * qi_.tangents[k] * S.middleRows<2>(States::direction(k));
  }
  rows.bottomRows(errors.parameters()) = S.bottomRows(errors.parameters());
  for (int i = 0; i < root.rows; ++i) {
    for (int j = 0; j < kMaxStates; ++j) {
      root(i, j) = rows(i, j);
    }
  }
}

void PaperEstimator::prior_error_root(RowsView root) const {
  const ConstRowsView S = prior_.root();
  for (int i = 0; i < root.rows; ++i) {
    std::copy_n(&S(States::kDynamic + i, States::kDynamic), root.columns, root.row(i));
  }
}

Eigen::Matrix3d PaperEstimator::covariance_of_errors(const Rows3& by_errors) const {
  const Layout errors = error_layout();
  StateRows3<kMaxStates> rows(3, kMaxStates);
  for (int k = 0; k < kGyros; ++k) {
    rows.middleCols<2>(States::direction(k)) =
        by_errors.middleCols<3>(errors.direction(k)) * skew<double>(gyros_[k].h_in) * qi_.tangents[k];
  }
  rows.rightCols(errors.parameters()) = by_errors.rightCols(errors.parameters());
  errors_.see_through_uncertainty(rows_of(rows));
  return gram<kMaxStates>(rows);
}

}  // namespace trihedron
