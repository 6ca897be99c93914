#pragma once
/// Definitions of InvariantEstimator. Each instantiation is a translation unit of its own, since one takes the compiler
/// half a minute.

#include <Eigen/Householder>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "trihedron/core/innovation.hpp"
#include "trihedron/core/invariant_estimator.hpp"

namespace trihedron {

template <class Base, int N, FurtherStates F>
Result<InvariantEstimator<Base, N, F>, SetupFault> InvariantEstimator<Base, N, F>::create(const Setup& setup) {
  if (const auto fault = setup.fault()) {
    return *fault;
  }
  if ((F.clock_offset && !(setup.clock_offset_sigma_s > 0)) ||
      (F.orbital_error && !(setup.orbital_error_sigma_rad > 0)) ||
      (F.wandering_drift && !(setup.wandering_sigma_rad_s > 0 && setup.wandering_time_s > 0)) ||
      (F.readout_bias && !(setup.readout_bias_sigma > 0)) ||
      !std::all_of(setup.further_heads.begin(), setup.further_heads.end(),
                   [](const HeadSetup& head) { return head.alignment_sigma_rad > 0; })) {
    return SetupFault::kPriorNotPositiveDefinite;
  }
  constexpr int kOwn = N * Layout::kPerGyro;
  constexpr int kConstants = Layout::kStates - Layout::kDynamic;
  const auto root = information_root<kOwn>(setup.prior_covariance);
  if (!root) {
    return root.fault();
  }
  InvariantEstimator e;
  e.setup_ = setup;
  e.gyros_ = e.prior_gyros();
  Eigen::Matrix<double, kConstants, kConstants> constants = Eigen::Matrix<double, kConstants, kConstants>::Zero();
  constants.template topLeftCorner<kOwn, kOwn>() = root.value();
  constexpr int kFirst = Layout::kDynamic;
  if constexpr (F.readout_bias) {
    constants.diagonal().template segment<3 * N>(Layout::kBiases - kFirst).setConstant(1 / setup.readout_bias_sigma);
  }
  if constexpr (F.clock_offset) {
    constants(Layout::clock_offset() - kFirst, Layout::clock_offset() - kFirst) = 1 / setup.clock_offset_sigma_s;
  }
  if constexpr (F.orbital_error) {
    constants.diagonal()
        .template segment<6>(Layout::orbital_error() - kFirst)
        .setConstant(1 / setup.orbital_error_sigma_rad);
  }
  for (int head = 1; head <= F.further_heads; ++head) {
    constants.diagonal()
        .template segment<3>(Layout::head(head) - kFirst)
        .setConstant(1 / setup.further_heads[static_cast<std::size_t>(head - 1)].alignment_sigma_rad);
  }
  e.prior_.add_prior_of_constants(constants);
  if constexpr (F.wandering_drift) {
    Eigen::Matrix<double, 3 * N, Layout::kStates> rows = Eigen::Matrix<double, 3 * N, Layout::kStates>::Zero();
    rows.template middleCols<3 * N>(Layout::kDirections).setIdentity();
    e.prior_.add_information(Eigen::Matrix<double, 3 * N, Layout::kStates>(rows / setup.wandering_sigma_rad_s));
  }
  e.gate_ = OutlierGate(setup);
  return e;
}

template <class Base, int N, FurtherStates F>
double InvariantEstimator<Base, N, F>::second_order_rad(const Rows3& a, const Rows3& b) const {
  // E|a × b|² = tr A tr B − tr AB, over the two axes across a momentum.
  const Eigen::Matrix3d A = gram(information_.template through_uncertainty<3>(a));
  const Eigen::Matrix3d B = gram(information_.template through_uncertainty<3>(b));
  const double square = A.trace() * B.trace() - A.cwiseProduct(B).sum();
  return std::sqrt(std::max(square, 0.0) / 8);
}

template <class Base, int N, FurtherStates F>
void InvariantEstimator<Base, N, F>::update_to_now(const Eigen::Matrix3d& C_in_c) {
  typename Information::DynamicMatrix A_inverse = Information::DynamicMatrix::Zero();
  typename Information::DynamicByConstants B = Information::DynamicByConstants::Zero();
  typename Information::DynamicVector noise = Information::DynamicVector::Zero();
  const double walk = setup_.direction_random_walk_rad_sqrt_s;
  for (int k = 0; k < N; ++k) {
    const int row = Layout::direction(k);
    // An error that keeps its sign as long as the estimates are what they are: its sigma grows, not its variance.
    Rows3 alignment = Rows3::Zero();
    Rows3 drifted = Rows3::Zero();
    alignment.template middleCols<3>(Layout::alignment(k)) = C_in_c;
    drifted.template middleCols<Base::kSize>(Layout::drift(k)) =
        since_fix_[k].by_drift.template leftCols<Base::kSize>();
    const double before = second_order_rad_[k];
    second_order_rad_[k] += second_order_rad(alignment, drifted);
    const double sigma = std::sqrt(walk * walk * time_since_fix_s_ + extra_variance_rad2_ +
                                   second_order_rad_[k] * second_order_rad_[k] - before * before);
    const Eigen::Matrix3d to_start = since_fix_[k].by_start.inverse();
    A_inverse.template block<3, 3>(row, row) = to_start;
    B.template block<3, Base::kSize>(row, Layout::drift(k) - Layout::kDynamic) =
        since_fix_[k].by_drift.template leftCols<Base::kSize>();
    B.template block<3, 3>(row, Layout::alignment(k) - Layout::kDynamic) = since_fix_[k].by_alignment;
    noise.template segment<3>(row).setConstant(sigma);
    if constexpr (F.wandering_drift) {
      // Nothing is left of it after a long time; what A⁻¹ takes for that would be rounding.
      const double kept = std::max(std::exp(-time_since_fix_s_ / setup_.wandering_time_s), 1e-6);
      const int wandering = Layout::wandering(k);
      A_inverse.template block<3, 3>(row, wandering) =
          to_start * since_fix_[k].by_drift.template rightCols<3>() * (-1 / kept);
      A_inverse.template block<3, 3>(wandering, wandering) = 1 / kept * Eigen::Matrix3d::Identity();
      noise.template segment<3>(wandering).setConstant(setup_.wandering_sigma_rad_s * std::sqrt(1 - kept * kept));
      gyros_[k].drift_rad_s.template tail<3>() *= kept;
    }
  }
  information_.propagate(A_inverse, B, noise);
  since_fix_ = {};
  time_since_fix_s_ = 0;
  extra_variance_rad2_ = 0;
}

template <class Base, int N, FurtherStates F>
void InvariantEstimator<Base, N, F>::start(const Eigen::Matrix3d& C_in_c, const FixReadings<N>& readings,
                                           const Eigen::Matrix3d& R_c, const FixBySharedStates& by_shared) {
  // φ_k = C (δ_k − e) + readout: the momentum is read through the alignment at the fix, whose error e is common.
  Eigen::Matrix<double, 3 * N, Layout::kStates> H = Eigen::Matrix<double, 3 * N, Layout::kStates>::Zero();
  Eigen::Matrix<double, 3 * N, 3 * N> R;
  const Eigen::Matrix3d R_in = C_in_c * R_c * C_in_c.transpose();
  for (int k = 0; k < N; ++k) {
    if (readings.used[k]) {
      gyros_[k].h_in = (C_in_c * gyros_[k].in_c(readings.h_b[k])).normalized();
    }
    H.template block<3, 3>(3 * k, Layout::direction(k)).setIdentity();
    H.template block<3, 3>(3 * k, Layout::alignment(k)) = -C_in_c;
    if constexpr (F.readout_bias) {
      H.template block<3, 3>(3 * k, Layout::readout_bias(k)) =
          C_in_c * skew<double>(gyros_[k].in_c(readings.h_b[k])) * gyros_[k].C_c_b;
    }
    H.template block<3, F.shared()>(3 * k, Layout::kShared) = C_in_c * by_shared;
    for (int j = 0; j < N; ++j) {
      R.template block<3, 3>(3 * k, 3 * j) = R_in;
    }
    const double sigma = readings.used[k] ? setup_.readout_noise_rad[k] * readings.noise_factor : kUnknown_rad;
    R.template block<3, 3>(3 * k, 3 * k).diagonal().array() += sigma * sigma;
  }
  information_ = prior_;
  std::fill(second_order_rad_.begin(), second_order_rad_.end(), 0.0);
  solve_lower(cholesky_root<3 * N>(R), H);
  information_.add_information(H);
  since_fix_ = {};
  angles_since_fix_ = 0;
  time_since_fix_s_ = 0;
  extra_variance_rad2_ = 0;
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::attitude(const Gyros& gyros, const Directions& h_b, const GyroMask<N>& used)
    -> Result<AttitudeByDirections<N>, DirectionsFault> {
  return optimal_attitude<N>(momenta(gyros), in_c(gyros, h_b), used);
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::rotation(const Gyros& gyros, const Directions& h_b, const GyroMask<N>& used)
    -> Result<Rot<In, C>, DirectionsFault> {
  return optimal_rotation<N>(momenta(gyros), in_c(gyros, h_b), used);
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::prior_gyros() const -> Gyros {
  Gyros gyros;
  for (int k = 0; k < N; ++k) {
    gyros[k].drift_rad_s.setZero();
    gyros[k].drift_rad_s.template head<Base::kSize>() = setup_.prior[k].drift_rad_s;
    gyros[k].C_c_b = setup_.prior[k].C_c_b;
    gyros[k].readout_bias = setup_.prior[k].readout_bias;
  }
  return gyros;
}

template <class Base, int N, FurtherStates F>
bool InvariantEstimator<Base, N, F>::prior_allows_estimates() const {
  typename Information::Vector moved = Information::Vector::Zero();
  for (int k = 0; k < N; ++k) {
    const auto& before = setup_.prior[k];
    moved.template segment<Base::kSize>(Layout::drift(k)) =
        gyros_[k].drift_rad_s.template head<Base::kSize>() - before.drift_rad_s;
    moved.template segment<3>(Layout::alignment(k)) =
        Rot<C, C>::assume(Eigen::Matrix3d(gyros_[k].C_c_b * before.C_c_b.transpose())).log().raw();
  }
  return (prior_.root() * moved).squaredNorm() <= gate_of_freedom(N * Layout::kPerGyro, setup_.gate_nis);
}

template <class Base, int N, FurtherStates F>
void InvariantEstimator<Base, N, F>::predict(const Eigen::Matrix3d& C_in_c, const Directions& h_b, double dt_s) {
  for (int k = 0; k < N; ++k) {
    precess(gyros_[k], since_fix_[k], C_in_c, h_b[k], dt_s);
  }
  time_since_fix_s_ += dt_s;
  gate_.elapse(dt_s);
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::fix_by_shared(Time t, int head, const Eigen::Vector3d& rate_c) const
    -> FixBySharedStates {
  FixBySharedStates by = FixBySharedStates::Zero();
  if constexpr (F.clock_offset) {
    by.col(Layout::clock_offset() - Layout::kShared) = rate_c;
  }
  if constexpr (F.orbital_error) {
    if (head == 0) {
      const double phase = setup_.orbital_rate_rad_s * to_seconds(t - setup_.orbital_phase_zero);
      constexpr int kFirst = Layout::orbital_error() - Layout::kShared;
      by.template middleCols<3>(kFirst) = std::sin(phase) * Eigen::Matrix3d::Identity();
      by.template middleCols<3>(kFirst + 3) = std::cos(phase) * Eigen::Matrix3d::Identity();
    }
  }
  if constexpr (F.further_heads > 0) {
    if (head > 0) {
      by.template middleCols<3>(Layout::head(head) - Layout::kShared).setIdentity();
    }
  }
  return by;
}

template <class Base, int N, FurtherStates F>
Eigen::Matrix3d InvariantEstimator<Base, N, F>::fix_noise(int head) const {
  Eigen::Matrix3d root = setup_.star_tracker_noise_rad.asDiagonal();
  if constexpr (F.further_heads > 0) {
    if (head > 0) {
      const HeadSetup& its = setup_.further_heads[static_cast<std::size_t>(head - 1)];
      root = its.C_c_s * its.noise_rad.asDiagonal();
    }
  }
  return root * root.transpose();
}

template <class Base, int N, FurtherStates F>
Eigen::Matrix3d InvariantEstimator<Base, N, F>::fused_attitude(const AttitudeByDirections<N>& by_gyros,
                                                               const Rot<In, C>& by_fix, const Eigen::Matrix3d& R_c,
                                                               const FixReadings<N>& readings) const {
  const Eigen::Matrix3d C_c_in = by_gyros.C_in_c.raw().transpose();
  Eigen::Matrix<double, 3, Layout::kStates> by_states = Eigen::Matrix<double, 3, Layout::kStates>::Zero();
  Eigen::Matrix3d P = Eigen::Matrix3d::Zero();
  for (int k = 0; k < N; ++k) {
    const Eigen::Matrix3d by_phi = by_gyros.by_directions.template middleCols<3>(3 * k);
    by_states.template middleCols<3>(Layout::direction(k)) = by_phi * C_c_in;
    by_states.template middleCols<3>(Layout::alignment(k)) = -by_phi;
    if constexpr (F.readout_bias) {
      by_states.template middleCols<3>(Layout::readout_bias(k)) =
          by_phi * skew<double>(gyros_[k].in_c(readings.h_b[k])) * gyros_[k].C_c_b;
    }
    const double sigma = setup_.readout_noise_rad[k] * readings.noise_factor;
    P += sigma * sigma * by_phi * by_phi.transpose();
  }
  P += gram(information_.template through_uncertainty<3>(by_states));
  Eigen::Vector3d weighted = (by_gyros.C_in_c.inverse() * by_fix).log().raw();
  solve_factorized(cholesky_root<3>(P + R_c), weighted);
  return (by_gyros.C_in_c * Rot<C, C>::exp(Vec<C>::assume(P * weighted))).raw();
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::measure(const Gyros& gyros, const Eigen::Matrix3d& C_in_c,
                                             const Eigen::Matrix3d& C_linear, const Directions& h_b,
                                             const Eigen::Matrix3d& R_c, const FixBySharedStates& by_shared,
                                             const PerGyro<double, N>& readout_noise_rad) -> Measurement {
  Measurement m;
  Eigen::Matrix<double, kMeasurements, 3> by_fix;
  for (int k = 0; k < N; ++k) {
    const Eigen::Vector3d& h = gyros[k].h_in;
    Eigen::Matrix<double, 2, 3> across;
    across.row(0) = h.cross(gyros[(k + 1) % N].h_in).normalized().transpose();
    across.row(1) = h.cross(across.row(0).transpose()).transpose();
    const int row = 2 * k;
    m.y.template segment<2>(row) = across * h.cross(C_in_c * gyros[k].in_c(h_b[k]));
    m.H.template block<2, 3>(row, Layout::direction(k)) = across;
    m.H.template block<2, 3>(row, Layout::alignment(k)) = -across * C_linear;
    if constexpr (F.readout_bias) {
      m.H.template block<2, 3>(row, Layout::readout_bias(k)) = across * skew<double>(h) * C_linear * gyros[k].C_c_b;
    }
    by_fix.template middleRows<2>(row) = across * C_linear;
    m.R.template block<2, 2>(row, row).diagonal().setConstant(readout_noise_rad[k] * readout_noise_rad[k]);
  }
  m.H.template rightCols<F.shared()>() = by_fix * by_shared;
  m.R += by_fix * R_c * by_fix.transpose();
  return m;
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::reading_noise(const Eigen::Matrix3d& C_linear, double noise_factor, int n) const
    -> PerGyro<double, N> {
  PerGyro<double, N> noise_rad;
  // Without a fix between them they keep their sign: n readings must not average them away.
  const double in_a_row = std::sqrt(static_cast<double>(n));
  for (int k = 0; k < N; ++k) {
    Rows3 alignment = Rows3::Zero();
    alignment.template middleCols<3>(Layout::alignment(k)) = C_linear;
    Rows3 apart = -alignment;
    apart.template middleCols<3>(Layout::direction(k)).setIdentity();
    noise_rad[k] =
        std::hypot(setup_.readout_noise_rad[k] * noise_factor, in_a_row * second_order_rad(alignment, apart));
  }
  return noise_rad;
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::correct(const StarFix& fix, const FixReadings<N>& readings) -> Report {
  Report report;
  report.t = fix.t;
  // The fix without what is known of its error.
  const FixBySharedStates by_shared = fix_by_shared(fix.t, fix.head, readings.rate_c);
  const Eigen::Vector3d known_error = by_shared * shared_;
  const Rot<In, C> C_in_c = Rot<In, C>::assume(fix.q_in_c.normalized()) * Rot<C, C>::exp(-Vec<C>::assume(known_error));
  const Eigen::Matrix3d R_c = fix_noise(fix.head);
  const auto by_gyros = attitude(gyros_, readings.h_b, readings.used);
  if (!started_) {
    start(C_in_c.raw(), readings, R_c, by_shared);
    started_ = attitude(gyros_, readings.h_b).ok();
    report.status = started_ ? FixStatus::kStarted : FixStatus::kRejectedGeometry;
    return report;
  }
  if (!by_gyros) {
    report.status = FixStatus::kRejectedGeometry;
    return report;
  }
  update_to_now(by_gyros.value().C_in_c.raw());
  const Eigen::Matrix3d C_linear = fused_attitude(by_gyros.value(), C_in_c, R_c, readings);
  const PerGyro<double, N> noise_rad = reading_noise(C_linear, readings.noise_factor, 1);
  Measurement m = measure(gyros_, C_in_c.raw(), C_linear, readings.h_b, R_c, by_shared, noise_rad);
  leave_out_unused(readings.used, m);

  const auto white = whitened<Information, kMeasurements>(m.H, m.y, m.R);
  report_innovation(information_, white, report);
  report.status = gate_.judge(report.nis, m.y.norm(), 2 * count(readings.used));
  report.rejections_in_a_row = gate_.rejections_in_a_row();
  report.jumped = gate_.jumped();
  report.weight = student_t_weight(setup_.student_t_freedom, report.nis, 2 * count(readings.used));
  switch (report.status) {
    case FixStatus::kRejectedByGate:
      // What a turn of them all explains is the star tracker's.
      if (is_fault(report.nis, m.y.norm(), readings.used) &&
          !angles_agree(measure_angles(by_gyros.value().C_in_c.raw(), readings, 1), readings.used)) {
        report.odd_gyro = odd_gyro(
            m, readings.used, [this](const Measurement& rest, const GyroMask<N>& used) { return agrees(rest, used); });
      }
      if (!(report.weight < 1) || report.jumped || report.odd_gyro != kNoGyro) {
        return report;
      }
      report.status = FixStatus::kUsed;
      break;
    case FixStatus::kRestarted:
      // Information gathered about a far wrong estimate: begin anew from the present one, and where that is no better,
      // from what was known.
      begun_from_estimates_ = !begun_from_estimates_ && prior_allows_estimates();
      if (!begun_from_estimates_) {
        gyros_ = prior_gyros();
        shared_.setZero();
      }
      start(C_in_c.raw(), readings, R_c, by_shared);
      report.weight = 1;
      return report;
    case FixStatus::kUsedAfterReopening:
      begun_from_estimates_ = false;  // long ago: it had helped
      add_direction_variance(m.y.squaredNorm() / kMeasurements);
      update_to_now(C_linear);
      report.weight = 1;
      break;
    default:
      break;
  }
  angles_since_fix_ = 0;
  const double root_weight = std::sqrt(report.weight);
  feed_back(information_.template update<kMeasurements>(root_weight * white.H, root_weight * white.y));
  return report;
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::angles_of(const Measurement& m) -> WhiteAngles {
  // The rows of H by the alignments are, but for the sign, those by an error of the attitude, common to all. A large
  // R_c in its place would still be a claim, and 10 000 of them no small one. Reflections that leave the attitude in
  // three rows only: the others are what is left.
  Eigen::Matrix<double, kMeasurements, 3 + Layout::kStates + 1> rows;
  for (int k = 0; k < N; ++k) {
    rows.template block<2, 3>(2 * k, 0) = m.H.template block<2, 3>(2 * k, Layout::alignment(k));
  }
  rows.template middleCols<Layout::kStates>(3) = m.H;
  rows.template rightCols<1>() = m.y;
  rows.array().colwise() /= m.R.diagonal().array().sqrt();
  Eigen::Matrix<double, rows.ColsAtCompileTime, 1> workspace;
  for (int j = 0; j < 3; ++j) {
    const int below = kMeasurements - j;
    Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMeasurements, 1> essential(below - 1);
    double tau = 0;
    double diagonal = 0;
    rows.col(j).tail(below).makeHouseholder(essential, tau, diagonal);
    rows.bottomRows(below).applyHouseholderOnTheLeft(essential, tau, workspace.data());
  }
  WhiteAngles white;
  white.H = rows.template block<kAngles, Layout::kStates>(3, 3);
  white.y = rows.template bottomRightCorner<kAngles, 1>();
  white.noise_root.setIdentity();
  return white;
}

template <class Base, int N, FurtherStates F>
void InvariantEstimator<Base, N, F>::leave_out(int gyro, Measurement& m) {
  const int row = 2 * gyro;
  m.y.template segment<2>(row).setZero();
  m.H.template middleRows<2>(row).setZero();
  m.R.template middleRows<2>(row).setZero();
  m.R.template middleCols<2>(row).setZero();
  m.R.template block<2, 2>(row, row).setIdentity();
}

template <class Base, int N, FurtherStates F>
void InvariantEstimator<Base, N, F>::leave_out_unused(const GyroMask<N>& used, Measurement& m) {
  for (int k = 0; k < N; ++k) {
    if (!used[k]) {
      leave_out(k, m);
    }
  }
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::measure_angles(const Eigen::Matrix3d& C_in_c, const FixReadings<N>& readings,
                                                    int n) const -> Measurement {
  Measurement m = measure(gyros_, C_in_c, C_in_c, readings.h_b, Eigen::Matrix3d::Zero(), FixBySharedStates::Zero(),
                          reading_noise(C_in_c, readings.noise_factor, n));
  leave_out_unused(readings.used, m);
  return m;
}

template <class Base, int N, FurtherStates F>
bool InvariantEstimator<Base, N, F>::is_fault(double nis, double misfit_rad, const GyroMask<N>& used) const {
  // Estimates from which the filter has begun anew may be what is wrong: next it begins from what was known.
  const bool last_resort = gate_.begun_anew() && !begun_from_estimates_ && misfit_rad > kPlainOfTwo_rad;
  return nis > kPlain * setup_.gate_nis && (count(used) > 2 || last_resort);
}

template <class Base, int N, FurtherStates F>
bool InvariantEstimator<Base, N, F>::agrees(const Measurement& m, const GyroMask<N>& used) const {
  Report report;
  report_innovation(information_, whitened<Information, kMeasurements>(m.H, m.y, m.R), report);
  return report.nis <= gate_of_freedom(2 * count(used), setup_.gate_nis);
}

template <class Base, int N, FurtherStates F>
bool InvariantEstimator<Base, N, F>::angles_agree(const Measurement& m, const GyroMask<N>& used) const {
  AngleReport report;
  report_innovation(information_, angles_of(m), report);
  return report.nis <= gate_of_freedom(2 * count(used) - 3, setup_.gate_nis);
}

template <class Base, int N, FurtherStates F>
template <class Agrees>
int InvariantEstimator<Base, N, F>::odd_gyro(const Measurement& m, const GyroMask<N>& used, Agrees&& agrees) {
  int odd = kNoGyro;
  for (int k = 0; k < N; ++k) {
    GyroMask<N> others = used;
    others[k] = false;
    Measurement rest = m;
    leave_out(k, rest);
    if (used[k] && agrees(rest, others)) {
      if (odd != kNoGyro) {
        return kNoGyro;  // either may be
      }
      odd = k;
    }
  }
  return odd;
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::check_angles(Time t, const FixReadings<N>& readings) -> AngleReport {
  AngleReport report;
  report.t = t;
  const auto by_gyros = attitude(gyros_, readings.h_b, readings.used);
  if (!by_gyros) {
    report.status = FixStatus::kRejectedGeometry;
    return report;
  }
  const Eigen::Matrix3d& C_in_c = by_gyros.value().C_in_c.raw();
  update_to_now(C_in_c);
  const Measurement m = measure_angles(C_in_c, readings, ++angles_since_fix_);
  const WhiteAngles white = angles_of(m);
  report_innovation(information_, white, report);
  if (!angles_agree(m, readings.used)) {
    report.status = FixStatus::kRejectedByGate;
    if (count(readings.used) > 2 && is_fault(report.nis, m.y.norm(), readings.used)) {
      report.odd_gyro = odd_gyro(m, readings.used, [this](const Measurement& rest, const GyroMask<N>& used) {
        return angles_agree(rest, used);
      });
    }
    report.rejections_in_a_row = ++angle_rejections_in_a_row_;
    return report;
  }
  report.status = FixStatus::kUsed;
  angle_rejections_in_a_row_ = 0;
  feed_back(information_.template update<kAngles>(white.H, white.y));
  return report;
}

template <class Base, int N, FurtherStates F>
void InvariantEstimator<Base, N, F>::feed_back(const typename Information::Vector& x) {
  for (int k = 0; k < N; ++k) {
    auto& gyro = gyros_[k];
    gyro.h_in = rotated<double>(gyro.h_in, x.template segment<3>(Layout::direction(k))).normalized();
    gyro.drift_rad_s.template head<Base::kSize>() += x.template segment<Base::kSize>(Layout::drift(k));
    if constexpr (F.wandering_drift) {
      gyro.drift_rad_s.template tail<3>() += x.template segment<3>(Layout::wandering(k));
    }
    if constexpr (F.readout_bias) {
      gyro.readout_bias += x.template segment<3>(Layout::readout_bias(k));
    }
    const Eigen::Vector3d delta = x.template segment<3>(Layout::alignment(k));
    gyro.C_c_b =
        Eigen::Quaterniond(Rot<C, C>::exp(Vec<C>::assume(delta)).raw() * gyro.C_c_b).normalized().toRotationMatrix();
  }
  shared_ += x.template tail<F.shared()>();
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::error_root() const -> ErrorRoot {
  const typename Information::Matrix root = information_.inverse_root();
  ErrorRoot errors;
  for (int k = 0; k < N; ++k) {
    errors.template middleRows<3>(Errors::direction(k)) = root.template middleRows<3>(Layout::direction(k));
    errors.template middleRows<Base::kSize>(Errors::drift(k)) = root.template middleRows<Base::kSize>(Layout::drift(k));
    if constexpr (F.wandering_drift) {
      errors.template middleRows<3>(Errors::drift(k) + Base::kSize) = root.template middleRows<3>(Layout::wandering(k));
    }
    errors.template middleRows<3>(Errors::alignment(k)) = root.template middleRows<3>(Layout::alignment(k));
    if constexpr (F.readout_bias) {
      errors.template middleRows<3>(Errors::readout_bias(k)) = root.template middleRows<3>(Layout::readout_bias(k));
    }
  }
  return errors;
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::through_uncertainty(const Eigen::Matrix<double, 3, Errors::kSize>& by_errors) const
    -> Eigen::Matrix<double, 3, Layout::kStates> {
  Rows3 by_states = Rows3::Zero();
  for (int k = 0; k < N; ++k) {
    by_states.template middleCols<3>(Layout::direction(k)) = by_errors.template middleCols<3>(Errors::direction(k));
    by_states.template middleCols<Base::kSize>(Layout::drift(k)) =
        by_errors.template middleCols<Base::kSize>(Errors::drift(k));
    if constexpr (F.wandering_drift) {
      by_states.template middleCols<3>(Layout::wandering(k)) =
          by_errors.template middleCols<3>(Errors::drift(k) + Base::kSize);
    }
    by_states.template middleCols<3>(Layout::alignment(k)) = by_errors.template middleCols<3>(Errors::alignment(k));
    if constexpr (F.readout_bias) {
      by_states.template middleCols<3>(Layout::readout_bias(k)) =
          by_errors.template middleCols<3>(Errors::readout_bias(k));
    }
  }
  return information_.template through_uncertainty<3>(by_states);
}

template <class Base, int N, FurtherStates F>
auto InvariantEstimator<Base, N, F>::prior_parameter_root() const
    -> Eigen::Matrix<double, Errors::kSize - Errors::kDirections, Errors::kSize - Errors::kDirections> {
  constexpr int kSize = Errors::kSize - Errors::kDirections;
  using Own = ParameterLayout<Base, N>;
  Eigen::Matrix<double, kSize, kSize> root = Eigen::Matrix<double, kSize, kSize>::Zero();
  const Eigen::Matrix<double, Own::kSize, Own::kSize> own = cholesky_root<Own::kSize>(setup_.prior_covariance);
  for (int k = 0; k < N; ++k) {
    const int row = Errors::drift(k) - Errors::kDirections;
    root.template block<Base::kSize, Own::kSize>(row, 0) = own.template middleRows<Base::kSize>(Own::drift(k));
    root.template block<3, Own::kSize>(Errors::alignment(k) - Errors::kDirections, 0) =
        own.template middleRows<3>(Own::alignment(k));
    if constexpr (F.wandering_drift) {
      root.template block<3, 3>(row + Base::kSize, Own::kSize + 3 * k)
          .diagonal()
          .setConstant(setup_.wandering_sigma_rad_s);
    }
    if constexpr (F.readout_bias) {
      constexpr int kBiases = Errors::kBiases - Errors::kDirections;
      root.template bottomRightCorner<kSize - kBiases, kSize - kBiases>().diagonal().setConstant(
          setup_.readout_bias_sigma);
    }
  }
  return root;
}

}  // namespace trihedron
