#pragma once
/// Definitions of InvariantEstimator.

#include <algorithm>
#include <cmath>

#include "trihedron/core/cholesky.hpp"
#include "trihedron/core/elementary.hpp"
#include "trihedron/core/invariant_estimator.hpp"

namespace trihedron {

template <Capacity kCapacity>
std::optional<SetupFault> InvariantEstimator<kCapacity>::set_up(const CalibrationSetup& setup, const Gyros& prior,
                                                                const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  const Layout& layout = setup.layout;
  if (!kCapacity.holds(layout) || layout.direction_size != 3) {
    return SetupFault::kTooLarge;
  }
  if (const auto fault = setup.fault()) {
    return fault;
  }
  if (!means_are_usable(prior, layout)) {
    return SetupFault::kPriorMeanNotUsable;
  }
  const int behind = layout.direction(layout.gyros);
  const int size = layout.size() - behind;
  std::array<double, static_cast<std::size_t>(kMaxStatesOfPrior) * kMaxStatesOfPrior> room{};
  const RowsView S{room.data(), size, size, size};
  for (int i = 0; i < layout.dynamic() - behind; ++i) {
    S(i, i) = setup.wandering_drift.sigma;
  }
  const int first = layout.drift(0) - behind;
  const int together = covariance.rows() == layout.drift_parameters() ? layout.drift_parameters() : layout.parameters();
  if (!covariance_root(covariance, {&S(first, first), together, together, size})) {
    return SetupFault::kPriorNotPositiveDefinite;
  }
  for (int i = first + together; i < size; ++i) {
    S(i, i) = prior_sigma_of_further_state(setup, behind + i);
  }
  setup_ = setup;
  drift_ = DriftModel(layout.drift_model, layout.further);
  prior_gyros_ = prior;
  prior_.pack(S);
  forget();
  return std::nullopt;
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::forget() {
  gyros_ = prior_gyros_;
  shared_ = Shared::Zero(layout().shared_size());
  errors_.reset(layout().size());
  gate_ = {};
  correlation_ = {};
  begin_stretch();
  angles_since_fix_ = 0;
  angle_rejections_in_a_row_ = 0;
  restarted_from_estimates_ = false;
  started_ = false;
}

template <Capacity kCapacity>
bool InvariantEstimator<kCapacity>::sound() const {
  return errors_.regular() && shared_.allFinite() && estimates_are_finite(gyros_, layout());
}

template <Capacity kCapacity>
double InvariantEstimator<kCapacity>::fixes_sharing_samples_of(const StarFix& fix) const {
  const std::optional<Time>& last = used_fix_t_[static_cast<std::size_t>(fix.head)];
  return last && *last < fix.t ? setup_.fixes_sharing_a_sample(fix.t - *last) : 1;
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::begin_stretch() {
  since_fix_.begin(layout().drift_columns());
  time_since_fix_s_ = 0;
  extra_variance_rad2_ = 0;
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::prior_error_root(RowsView root) const {
  prior_.unpack(root);
}

template <Capacity kCapacity>
Eigen::Matrix3d InvariantEstimator<kCapacity>::covariance_of(Rows3 by_states) const {
  errors_.see_through_uncertainty(rows_of(by_states));
  return gram<kMaxStates>(by_states);
}

template <Capacity kCapacity>
template <class Rows>
Eigen::Matrix3d InvariantEstimator<kCapacity>::covariance_from(int first, const Rows& some) const {
  Rows3 rows = Rows3::Zero(3, layout().size() - first);
  rows.leftCols(some.cols()) = some;
  return covariance_of(rows);
}

template <Capacity kCapacity>
double InvariantEstimator<kCapacity>::second_order_rad(const Eigen::Matrix3d& A, const Eigen::Matrix3d& B) {
  // E|a × b|² = tr A tr B − tr AB, over the two axes across a momentum.
  const double square = A.trace() * B.trace() - A.cwiseProduct(B).sum();
  return std::sqrt(std::max(square, 0.0) / 8);
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::look_at_second_order(const FixReadings& readings) {
  constexpr float kLonger = 1.5F;
  constexpr float kOtherwise = 0.5F;
  const Eigen::Vector3f rate_c = readings.rate_c.cast<float>();
  const auto interval_s = static_cast<float>(time_since_fix_s_);
  second_order_.hold_s -= interval_s;
  const bool holds = second_order_.hold_s > 0 && second_order_.hold_s <= kHoldSecondOrder_s &&
                     interval_s <= kLonger * second_order_.interval_s &&
                     (rate_c - second_order_.rate_c).norm() < kOtherwise * second_order_.rate_c.norm();
  if (!holds) {
    second_order_.hold_s = 0;
    second_order_.interval_s = interval_s;
    second_order_.rate_c = rate_c;
  }
}

template <Capacity kCapacity>
auto InvariantEstimator<kCapacity>::prediction_noise(const Eigen::Matrix3d& C_in_c)
    -> PerGyro<double, kCapacity.gyros> {
  const Layout& layout = setup_.layout;
  const double walk = setup_.direction_random_walk_rad_sqrt_s;
  const bool to_be_worked_out = !(second_order_.hold_s > 0);
  PerGyro<double, kCapacity.gyros> noise_rad;
  for (int k = 0; k < layout.gyros; ++k) {
    if (to_be_worked_out && time_since_fix_s_ > 0) {
      const Eigen::Matrix3d alignment = covariance_from(layout.alignment(k), C_in_c);
      const Eigen::Matrix3d drift = covariance_from(
          layout.drift(k), since_fix_.all()[k].by_drift.first(layout.drift_columns()).leftCols(layout.drift_size()));
      second_order_.prediction_rad_s[k] = second_order_rad(alignment, drift) / time_since_fix_s_;
    }
    // This error keeps its sign until the estimates change, so its sigma adds up, not its variance, and a random walk
    // needs more than the same sigma to cover it (docs/mathematics.md, section 8).
    constexpr double kOfARamp = 1.4;
    const double before = second_order_rad_[k];
    second_order_rad_[k] += kOfARamp * second_order_.prediction_rad_s[k] * time_since_fix_s_;
    noise_rad[k] = std::sqrt(walk * walk * time_since_fix_s_ + extra_variance_rad2_ +
                             second_order_rad_[k] * second_order_rad_[k] - before * before);
  }
  return noise_rad;
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::propagate(const PerGyro<double, kCapacity.gyros>& noise_rad) {
  const Layout& layout = setup_.layout;
  const int d = layout.dynamic();
  typename Errors::DynamicByStates F = Errors::DynamicByStates::Zero(d, layout.size());
  typename Errors::DynamicVector noise = Errors::DynamicVector::Zero(d);
  const double kept = setup_.wandering_drift.kept(time_since_fix_s_);
  for (int k = 0; k < layout.gyros; ++k) {
    const auto& since = since_fix_.all()[k];
    const auto by_drift = since.by_drift.first(layout.drift_columns());
    const int row = layout.direction(k);
    auto by_states = F.template middleRows<3>(row);
    by_states.template middleCols<3>(row) = since.by_start;
    by_states.template middleCols<3>(layout.alignment(k)) = since.by_alignment;
    put_drift_columns(layout, k, by_drift, by_states);
    noise.template segment<3>(row).setConstant(noise_rad[k]);
    if (layout.further.wandering_drift) {
      const int wandering = layout.wandering(k);
      F.template block<3, 3>(wandering, wandering).diagonal().setConstant(kept);
      noise.template segment<3>(wandering).setConstant(setup_.wandering_drift.noise(kept));
      gyros_[k].drift_rad_s.template segment<3>(layout.wandering_column()) *= kept;
    }
  }
  errors_.propagate(rows_of(F), noise);
  begin_stretch();
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::follow_alignments(const FixReadings& readings) {
  since_fix_.settle();
  for (int k = 0; k < layout().gyros; ++k) {
    if (!readings.used[k]) {
      continue;
    }
    const Gyro& gyro = gyros_[k];
    auto& since = since_fix_.all()[k];
    auto by_drift = since.by_drift.first(layout().drift_columns());
    for (int i = 0; i < by_drift.cols(); ++i) {
      const double along = gyro.h_in.dot(by_drift.col(i));
      by_drift.col(i) -= along * gyro.h_in;
    }
    // h_k · C_in_c δ_k has changed by what the reading has moved in c. The changes add up to that since the start, to
    // the rounding of one.
    const Eigen::Vector3f h_b = readings.h_b[k].template cast<float>();
    const Eigen::Vector3d moved_c = gyro.C_c_b * (h_b - h_b_at_fix_[k]).template cast<double>();
    const Eigen::Vector3d along = moved_c - since.by_alignment.transpose() * gyro.h_in;
    since.by_alignment += gyro.h_in * along.transpose();
    h_b_at_fix_[k] = h_b;
  }
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::start(const Seen& its, const FixReadings& readings) {
  const Eigen::Matrix3d& C_in_c = its.C_in_c.raw();
  // φ_k = C (δ_k − e) + readout: the momentum is read through the alignment at the fix, whose error e is common.
  constexpr int kMaxRows = 3 * kCapacity.gyros;
  const Layout& layout = setup_.layout;
  const int rows = 3 * layout.gyros;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMaxRows, kMaxStates> F(rows, layout.size());
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxRows, kMaxRows> R(rows, rows);
  F.setZero();
  const Eigen::Matrix3d R_in = C_in_c * its.R_c * C_in_c.transpose();
  for (int k = 0; k < layout.gyros; ++k) {
    const int row = 3 * k;
    if (readings.used[k]) {
      gyros_[k].h_in = (C_in_c * gyros_[k].in_c(readings.h_b[k])).normalized();
    }
    h_b_at_fix_[k] = gyros_[k].reading_of(C_in_c.transpose() * gyros_[k].h_in).template cast<float>();
    F.template block<3, 3>(row, layout.alignment(k)) = C_in_c;
    F.block(row, layout.readout(k), 3, layout.readout_size()) =
        by_readout_errors(layout, -C_in_c * skew<double>(gyros_[k].in_c(readings.h_b[k])), gyros_[k], readings.h_b[k]);
    F.block(row, layout.shared(), 3, layout.shared_size()) = -C_in_c.lazyProduct(its.by_shared);
    for (int j = 0; j < layout.gyros; ++j) {
      R.template block<3, 3>(row, 3 * j) = R_in;
    }
    const double sigma = readings.used[k] ? setup_.readout_noise_rad[k] * readings.noise_factor : kUnknown_rad;
    R.template block<3, 3>(row, row).diagonal().array() += sigma * sigma;
  }
  errors_.reset(layout.size());
  const RowsView S = errors_.root();
  const int behind = layout.direction(layout.gyros);
  prior_.unpack({&S(behind, behind), layout.size() - behind, layout.size() - behind, S.stride});
  errors_.begin(rows_of(F), R);
  correlation_ = {};
  std::ranges::fill(second_order_rad_, 0.0);
  second_order_ = {};
  begin_stretch();
  angles_since_fix_ = 0;
}

template <Capacity kCapacity>
bool InvariantEstimator<kCapacity>::prior_allows_estimates() const {
  const Layout& layout = setup_.layout;
  Vector moved = Vector::Zero(layout.size());
  for (int k = 0; k < layout.gyros; ++k) {
    const Gyro& before = prior_gyros_[k];
    moved.segment(layout.drift(k), layout.drift_size()) =
        (gyros_[k].drift_rad_s - before.drift_rad_s).head(layout.drift_size());
    moved.template segment<3>(layout.alignment(k)) =
        Rot<C, C>::assume(Eigen::Matrix3d(gyros_[k].C_c_b * before.C_c_b.transpose())).log().raw();
  }
  prior_.solve(&moved(layout.direction(layout.gyros)));
  return moved.squaredNorm() <= gate_of_freedom(layout.parameters(), setup_.gate_nis);
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::predict(const Eigen::Matrix3d& C_in_c, const Directions& h_b, Time t, double dt_s) {
  const auto times = [&] { return setup_.drift_times(t - from_seconds(dt_s / 2)); };
  since_fix_.precess_all(gyros_, layout().gyros, drift_, C_in_c, h_b, times, dt_s);
  time_since_fix_s_ += dt_s;
  gate_.elapse(dt_s);
}

template <Capacity kCapacity>
Eigen::Matrix3d InvariantEstimator<kCapacity>::fused_attitude(const AttitudeByDirections& by_gyros, const Seen& its,
                                                              const StarFix& fix, const FixReadings& readings) const {
  const Eigen::Matrix3d spread =
      covariance_of(attitude_by_states_now<kMaxStates>(layout(), by_gyros, gyros_, readings.h_b));
  const Eigen::Matrix3d P =
      with_covariance(by_gyros, spread, readout_noise(readings.noise_factor), layout().gyros, 0).covariance_rad2;
  Eigen::Vector3d weighted = (by_gyros.C_in_c.inverse() * its.C_in_c).log().raw();
  const Eigen::Matrix3d R_c = its.R_c + misalignment_of(fix, readings);
  solve_factorized(matrix_of(cholesky_root<3>(P + R_c)), weighted);
  return (by_gyros.C_in_c * Rot<C, C>::exp(Vec<C>::assume(P * weighted))).raw();
}

template <Capacity kCapacity>
PerGyro<double> InvariantEstimator<kCapacity>::readout_noise(double noise_factor) const {
  PerGyro<double> noise_rad;
  for (int k = 0; k < layout().gyros; ++k) {
    noise_rad[k] = setup_.readout_noise_rad[k] * noise_factor;
  }
  return noise_rad;
}

template <Capacity kCapacity>
auto InvariantEstimator<kCapacity>::second_order_of_reading(const Eigen::Matrix3d& C_linear) const
    -> PerGyro<double, kCapacity.gyros> {
  PerGyro<double, kCapacity.gyros> second_order;
  for (int k = 0; k < layout().gyros; ++k) {
    const Eigen::Matrix3d alignment = covariance_from(layout().alignment(k), -C_linear);
    Rows3 rows = Rows3::Zero(3, layout().size());
    rows.template middleCols<3>(layout().alignment(k)) = -C_linear;
    rows.template middleCols<3>(layout().direction(k)).setIdentity();
    second_order[k] = second_order_rad(alignment, covariance_of(rows));
  }
  return second_order;
}

template <Capacity kCapacity>
PerGyro<double> InvariantEstimator<kCapacity>::reading_noise(const Eigen::Matrix3d& C_linear, double noise_factor,
                                                             int n) const {
  PerGyro<double> noise_rad = readout_noise(noise_factor);
  const PerGyro<double, kCapacity.gyros> second_order = second_order_of_reading(C_linear);
  // Without a fix between them these errors keep their sign: n readings must not average them away.
  const double in_a_row = std::sqrt(static_cast<double>(n));
  for (int k = 0; k < layout().gyros; ++k) {
    noise_rad[k] = elementary::root_of_squares(noise_rad[k], in_a_row * second_order[k]);
  }
  return noise_rad;
}

template <Capacity kCapacity>
PerGyro<double> InvariantEstimator<kCapacity>::fix_reading_noise(const Eigen::Matrix3d& C_linear, double noise_factor,
                                                                 const Eigen::Matrix3d& misalignment) {
  PerGyro<double> noise_rad = readout_noise(noise_factor);
  if (!(second_order_.hold_s > 0)) {
    second_order_.reading_rad = second_order_of_reading(C_linear);
    bool all_small = true;
    for (int k = 0; k < layout().gyros; ++k) {
      const double most = std::max(second_order_.reading_rad[k],
                                   second_order_.prediction_rad_s[k] * static_cast<double>(kHoldSecondOrder_s));
      all_small = all_small && most < kSmallSecondOrder * noise_rad[k];
    }
    second_order_.hold_s = all_small ? kHoldSecondOrder_s : 0;
  }
  // Of the second order, and not normal: three times its sigma costs nothing but the weight of the first such fix.
  const double of_fix = 3 * second_order_rad(misalignment, misalignment);
  for (int k = 0; k < layout().gyros; ++k) {
    noise_rad[k] = elementary::root_of_squares(noise_rad[k], second_order_.reading_rad[k]);
    noise_rad[k] = elementary::root_of_squares(noise_rad[k], of_fix);
  }
  return noise_rad;
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::restart(const Seen& its, const FixReadings& readings) {
  // The information was gathered about estimates that are far off: restart from the present ones, and where that is no
  // better, from the prior.
  restarted_from_estimates_ = !restarted_from_estimates_ && prior_allows_estimates();
  if (!restarted_from_estimates_) {
    gyros_ = prior_gyros_;
    shared_.setZero();
  }
  start(its, readings);
}

template <Capacity kCapacity>
Eigen::Matrix3d InvariantEstimator<kCapacity>::misalignment_of(const StarFix& fix, const FixReadings& readings) const {
  if (fix.head == 0) {
    return Eigen::Matrix3d::Zero();  // its axes are c
  }
  Rows3 rows = Rows3::Zero(3, layout().size());
  rows.rightCols(layout().shared_size()) = fix_by_shared_states(setup_, fix, readings.rate_c);
  return covariance_of(rows);
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::put_innovation(White& white) const {
  const int components = static_cast<int>(white.seen.rows());
  const RowsView H = states_of(white.seen);
  errors_.see_through_uncertainty(H);
  white.covariance = ComponentCovariance::Identity(components, components);
  add_square({H.data, H.rows, H.columns, H.stride}, white.covariance.data(), white.covariance.outerStride());
  ComponentCovariance root = white.covariance;
  static_cast<void>(factorize(root));
  white.y = white.seen.col(layout().size());
  solve_lower(matrix_of(root), white.y);
  white.nis = white.y.squaredNorm();
}

template <Capacity kCapacity>
auto InvariantEstimator<kCapacity>::whitened(const FixComparison& comparison, const Eigen::Matrix3d& R_c,
                                             const PerGyro<double>& noise_rad) const -> White {
  White white;
  white.seen = rows_about_states_now<kMaxStates, kMaxCompared>(layout(), comparison);
  white.L = noise_of(comparison, R_c, noise_rad);
  whiten(white.L, rows_of(white.seen));
  put_innovation(white);
  return white;
}

template <Capacity kCapacity>
auto InvariantEstimator<kCapacity>::rows_to_use(const FixComparison& comparison, const Eigen::Matrix3d& R_c,
                                                PerGyro<double> noise_rad, double noise_factor, double sharing) const
    -> Compared {
  if (sharing > 1) {
    const PerGyro<double> readout_rad = readout_noise(noise_factor * std::sqrt(sharing - 1));
    for (int k = 0; k < layout().gyros; ++k) {
      noise_rad[k] = elementary::root_of_squares(noise_rad[k], readout_rad[k]);
    }
  }
  Compared rows = rows_about_states_now<kMaxStates, kMaxCompared>(layout(), comparison);
  ComponentCovariance L = noise_of(comparison, R_c, noise_rad);
  whiten(L, rows_of(rows));
  return rows;
}

template <Capacity kCapacity>
auto InvariantEstimator<kCapacity>::angles_of(const FixComparison& comparison, const PerGyro<double>& noise_rad) const
    -> White {
  // An error of the attitude is common to all components. A very large R_c instead would still add some information on
  // the attitude, which thousands of updates sum up. Reflections leave the attitude in three rows only: the others are
  // what is left.
  const int components = comparison.components();
  const int columns = layout().size() + 1;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMaxCompared, 3 + kMaxStates + 1> rows(
      components, 3 + columns);
  rows.rightCols(columns) = rows_about_states_now<kMaxStates, kMaxCompared>(layout(), comparison);
  int row = 0;
  for (int k = 0; k < layout().gyros; ++k) {
    if (comparison.used[k]) {
      rows.template block<2, 3>(row, 0) = comparison.gyros[k].by_fix;
      rows.template middleRows<2>(row) /= noise_rad[k];
      row += 2;
    }
  }
  triangularise(rows_of(rows), 3);
  White white;
  white.seen = rows.bottomRightCorner(components - 3, columns);
  put_innovation(white);
  return white;
}

template <Capacity kCapacity>
bool InvariantEstimator<kCapacity>::is_fault(double nis, double misfit_rad, int used) const {
  // After a restart from the estimates these may be wrong: first try a restart from the prior.
  const bool last_resort =
      gate_.restarted_recently() && !restarted_from_estimates_ && misfit_rad > kFaultMisfitOfPair_rad;
  return nis > kFaultGateRatio * setup_.gate_nis && (used > 2 || last_resort);
}

template <Capacity kCapacity>
template <class Agrees>
int InvariantEstimator<kCapacity>::odd_gyro(FixComparison& comparison, Agrees&& agrees) {
  int odd = kNoGyro;
  for (int k = 0; k < kMaxGyros; ++k) {
    if (!comparison.used[k]) {
      continue;
    }
    comparison.used[k] = false;
    const bool others_agree = agrees(comparison);
    comparison.used[k] = true;
    if (others_agree) {
      if (odd != kNoGyro) {
        return kNoGyro;  // more than one candidate: ambiguous
      }
      odd = k;
    }
  }
  return odd;
}

template <Capacity kCapacity>
bool InvariantEstimator<kCapacity>::angles_agree(const Eigen::Matrix3d& C_by_gyros, const FixReadings& readings) const {
  const PerGyro<double> noise_rad = reading_noise(C_by_gyros, readings.noise_factor, 1);
  const FixComparison angles = compare(layout(), gyros_, C_by_gyros, C_by_gyros, readings.h_b, readings.used,
                                       FixBySharedStates::Zero(3, layout().shared_size()));
  return angles_of(angles, noise_rad).nis <= gate_of_freedom(angles.components() - 3, setup_.gate_nis);
}

template <Capacity kCapacity>
int InvariantEstimator<kCapacity>::gyro_at_fault(FixComparison& comparison, const Eigen::Matrix3d& C_by_gyros,
                                                 const FixReadings& readings, const Eigen::Matrix3d& R_c,
                                                 const PerGyro<double>& noise_rad) const {
  if (angles_agree(C_by_gyros, readings)) {
    return kNoGyro;  // a misfit that a common rotation of all momenta explains is attributed to the star tracker
  }
  return odd_gyro(comparison, [&](const FixComparison& rest) {
    return whitened(rest, R_c, noise_rad).nis <= gate_of_freedom(rest.components(), setup_.gate_nis);
  });
}

namespace detail {

/// Length of the innovation.
[[nodiscard]] inline double misfit_rad(const FixComparison& comparison) {
  double square = 0;
  for (int k = 0; k < kMaxGyros; ++k) {
    square += comparison.used[k] ? comparison.gyros[k].y.squaredNorm() : 0;
  }
  return std::sqrt(square);
}

/// Two components for each gyro of the layout.
inline void report_innovation(const Layout& layout, const FixComparison& comparison,
                              const ComponentCovariance& covariance, FixReport& report) {
  const int size = 2 * layout.gyros;
  report.innovation.setZero(size);
  report.innovation_covariance.setZero(size, size);
  int row = 0;
  for (int k = 0; k < layout.gyros; ++k) {
    if (!comparison.used[k]) {
      continue;
    }
    report.innovation.template segment<2>(2L * k) = comparison.gyros[k].y;
    int column = 0;
    for (int j = 0; j < layout.gyros; ++j) {
      if (comparison.used[j]) {
        report.innovation_covariance.template block<2, 2>(2L * k, 2L * j) =
            covariance.template block<2, 2>(row, column);
        column += 2;
      }
    }
    row += 2;
  }
}

/// The angles between the momenta as they are read, against those estimated. Their covariance is that of the innovation
/// for each of the two moved towards the other, in which an error of the fix cancels; what they are off is found from
/// the readings, since in the innovation it does so to first order only.
template <class Gyros>
void report_angles(const Layout& layout, const Gyros& gyros, const FixComparison& comparison, const Directions& h_b,
                   FixReport& report) {
  for (int k = 0; k < layout.gyros; ++k) {
    for (int j = k + 1; j < layout.gyros; ++j) {
      const Eigen::Vector3d normal = gyros[k].h_in.cross(gyros[j].h_in);
      const double sine = normal.norm();
      if (!comparison.used[k] || !comparison.used[j] || !(sine >= kMinSine)) {
        continue;
      }
      const double off_rad = std::abs(cosine_off(gyros[k], gyros[j], h_b[k], h_b[j])) / sine;
      Eigen::Vector4d towards;
      towards << comparison.gyros[k].by_phi * normal / sine, -(comparison.gyros[j].by_phi * normal) / sine;
      Eigen::Matrix4d S;
      S << report.innovation_covariance.template block<2, 2>(2L * k, 2L * k),
          report.innovation_covariance.template block<2, 2>(2L * k, 2L * j),
          report.innovation_covariance.template block<2, 2>(2L * j, 2L * k),
          report.innovation_covariance.template block<2, 2>(2L * j, 2L * j);
      report.angle_off_rad = std::max(report.angle_off_rad, off_rad);
      report.angle_sigma_rad = std::max(report.angle_sigma_rad, std::sqrt(towards.dot(S * towards)));
    }
  }
}

}  // namespace detail

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::ask_gate(const FixComparison& comparison, const White& white, double misfit_rad,
                                             const Directions& h_b, FixReport& report) {
  constexpr double kPartOfMisfit = 0.2;  // less may be what the model leaves out
  report.nis = white.nis;
  detail::report_innovation(layout(), comparison, before_whitening(white.L, white.covariance), report);
  detail::report_angles(layout(), gyros_, comparison, h_b, report);

  const bool is_of_gyros = report.gyros_contradict() && report.angle_off_rad > kPartOfMisfit * misfit_rad;
  report.status = gate_.judge(setup_, report.nis, misfit_rad, comparison.components(), is_of_gyros);
  report.rejections_in_a_row = gate_.rejections_in_a_row();
  report.jumped = gate_.jumped();
  report.weight = student_t_weight(setup_.student_t_freedom, report.nis, comparison.components());
}

// ---- Corrections, stage by stage

template <Capacity kCapacity>
int InvariantEstimator<kCapacity>::cost(const Correction& correction) {
  constexpr std::array<int, 12> kCosts = {25, 75, 70, 65, 65, 105, 300, 150, 80, 140, 25, 0};
  return kCosts[static_cast<std::size_t>(correction.stage)];
}

template <Capacity kCapacity>
int InvariantEstimator<kCapacity>::cost_to_end(const Correction& correction) {
  using Stage = typename Correction::Stage;
  Correction next = correction;
  int sum = 0;
  for (auto stage = static_cast<int>(correction.stage); stage < static_cast<int>(Stage::kDone); ++stage) {
    next.stage = static_cast<Stage>(stage);
    const bool is_unusual =
        next.stage == Stage::kFault || next.stage == Stage::kRestart || next.stage == Stage::kWidening;
    const int times = next.stage == Stage::kWidening ? correction.widening_left : 1;
    sum += is_unusual && next.stage != correction.stage ? 0 : times * cost(next);
  }
  return sum;
}

template <Capacity kCapacity>
FixReport InvariantEstimator<kCapacity>::correct(const StarFix& fix, const FixReadings& readings) {
  Correction correction;
  correction.at_once = true;
  FixReport report;
  for (int i = 0; i < kMostStages && !correction.done(); ++i) {
    carry_on(correction, fix, readings, report);
  }
  return report;
}

template <Capacity kCapacity>
AngleReport InvariantEstimator<kCapacity>::check_angles(Time t, const FixReadings& readings) {
  Correction correction;
  AngleReport report;
  for (int i = 0; i < kMostStages && !correction.done(); ++i) {
    carry_on(correction, t, readings, report);
  }
  return report;
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::carry_on(Correction& correction, const StarFix& fix, const FixReadings& readings,
                                             FixReport& report) {
  take(correction, fix, readings, report);
  if (correction.done() && started_ && !sound()) {
    forget();
    report = lost(fix);
  }
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::carry_on(Correction& correction, Time t, const FixReadings& readings,
                                             AngleReport& report) {
  report.t = t;
  take_angles(correction, readings, report);
  if (correction.done() && !sound()) {
    forget();
    report = {.status = FixStatus::kEstimateLost, .t = t};
  }
}

template <Capacity kCapacity>
auto InvariantEstimator<kCapacity>::seen(const StarFix& fix, const FixReadings& readings) const -> Seen {
  const FixBySharedStates by_shared = fix_by_shared_states(setup_, fix, readings.rate_c);
  Seen its{by_shared, corrected(fix, by_shared.lazyProduct(shared_)), fix_noise(setup_, fix)};
  its.R_c.diagonal().array() += static_cast<double>(readings.jitter_rad2);
  return its;
}

template <Capacity kCapacity>
FixComparison InvariantEstimator<kCapacity>::compared(const Seen& its, const Correction& correction,
                                                      const FixReadings& readings) const {
  return compare(layout(), gyros_, its.C_in_c.raw(), correction.C_linear, readings.h_b, readings.used, its.by_shared);
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::take(Correction& correction, const StarFix& fix, const FixReadings& readings,
                                         FixReport& report) {
  using Stage = typename Correction::Stage;
  switch (correction.stage) {
    case Stage::kBegin:
      begin(correction, fix, readings, report);
      break;
    case Stage::kSecondOrder:
      follow_alignments(readings);
      look_at_second_order(readings);
      correction.prediction_noise_rad =
          prediction_noise(correction.reopened ? correction.C_linear : rotation_now(readings));
      correction.stage = Stage::kPropagation;
      break;
    case Stage::kPropagation:
      propagate(correction.prediction_noise_rad);
      correction.stage = correction.reopened ? Stage::kUpdate : Stage::kAttitude;
      break;
    case Stage::kAttitude:
      correction.C_linear = fused_attitude(attitude_now(readings), seen(fix, readings), fix, readings);
      correction.stage = Stage::kNoise;
      break;
    case Stage::kNoise:
      correction.reading_noise_rad =
          fix_reading_noise(correction.C_linear, readings.noise_factor, misalignment_of(fix, readings));
      correction.stage = Stage::kJudgement;
      break;
    case Stage::kJudgement:
      judge(correction, seen(fix, readings), fix, readings, report);
      break;
    case Stage::kFault:
      look_for_fault(correction, seen(fix, readings), readings, report);
      break;
    case Stage::kRestart:
      restart(seen(fix, readings), readings);
      report.weight = 1;
      correction.stage = Stage::kDone;
      break;
    case Stage::kWidening:
      widen(correction);
      break;
    case Stage::kUpdate:
      update(correction, seen(fix, readings), fix, readings, report);
      break;
    case Stage::kFeedback:
      feed_back();
      correction.stage = Stage::kDone;
      break;
    default:
      correction.stage = Stage::kDone;
      break;
  }
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::begin(Correction& correction, const StarFix& fix, const FixReadings& readings,
                                          FixReport& report) {
  report.t = fix.t;
  report.head = fix.head;
  correction.stage = Correction::Stage::kDone;
  if (!started_) {
    start(seen(fix, readings), readings);
    started_ = gives_attitude(gyros_, readings.h_b, all_gyros(layout().gyros));
    used_fix_t_ = {};
    used_fix_t_[static_cast<std::size_t>(fix.head)] = fix.t;
    report.status = started_ ? FixStatus::kStarted : FixStatus::kRejectedGeometry;
  } else if (!gives_attitude(gyros_, readings.h_b, readings.used)) {
    report.status = FixStatus::kRejectedGeometry;
  } else {
    correction.stage = Correction::Stage::kSecondOrder;
  }
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::judge(Correction& correction, const Seen& its, const StarFix& fix,
                                          const FixReadings& readings, FixReport& report) {
  using Stage = typename Correction::Stage;
  const FixComparison comparison = compared(its, correction, readings);
  const double misfit_rad = detail::misfit_rad(comparison);
  White white = whitened(comparison, its.R_c, correction.reading_noise_rad);
  ask_gate(comparison, white, misfit_rad, readings.h_b, report);
  correction.stage = Stage::kUpdate;
  if (report.status != FixStatus::kUsed) {
    second_order_.hold_s = 0;  // the next fix is further from the last that was used
  }
  switch (report.status) {
    case FixStatus::kRejectedByGate:
      if (is_fault(report.nis, misfit_rad, count(readings.used))) {
        correction.stage = Stage::kFault;
      } else {
        use_all_the_same(correction, report);
      }
      break;
    case FixStatus::kRestarted:
      correction.stage = Stage::kRestart;
      break;
    case FixStatus::kUsedAfterReopening:
      restarted_from_estimates_ = false;  // the last restart was long ago, so it had helped
      add_direction_variance(misfit_rad * misfit_rad / (2 * layout().gyros));
      correction.reopened = true;
      correction.stage = Stage::kSecondOrder;
      report.weight = 1;
      break;
    default:
      look_for_correlation(correction, white, report);
      break;
  }
  if (correction.stage == Stage::kUpdate && correction.at_once && !(fixes_sharing_samples_of(fix) > 1)) {
    use(correction, fix, white.seen, report.weight);  // the rows of the update are those that were judged
  }
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::look_for_correlation(Correction& correction, const White& white,
                                                         FixReport& report) {
  if (!setup_.widen_where_correlated) {
    return;
  }
  correlation_.add(white.y);
  if (correlation_.found()) {
    correlation_ = {};
    report.status = FixStatus::kUsedAfterWidening;
    correction.stage = Correction::Stage::kWidening;
  }
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::widen(Correction& correction) {
  constexpr int kParts = Correction::kWideningParts;
  const int part = kParts - correction.widening_left;
  if (part == 0) {
    errors_.scale(kWidening);
  }
  const auto begin_of = [this](int its) { return layout().dynamic() + layout().constants() * its / kParts; };
  errors_.take_prior(prior_, layout().direction(layout().gyros), begin_of(part), begin_of(part + 1),
                     std::sqrt(1 - 1 / (kWidening * kWidening)));
  --correction.widening_left;
  correction.stage = correction.widening_left > 0 ? Correction::Stage::kWidening : Correction::Stage::kUpdate;
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::use_all_the_same(Correction& correction, FixReport& report) {
  if (!(report.weight < 1) || report.jumped || report.odd_gyro != kNoGyro) {
    correction.stage = Correction::Stage::kDone;
    return;
  }
  report.status = FixStatus::kUsed;
  correction.stage = Correction::Stage::kUpdate;
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::look_for_fault(Correction& correction, const Seen& its, const FixReadings& readings,
                                                   FixReport& report) const {
  FixComparison comparison = compared(its, correction, readings);
  report.odd_gyro = gyro_at_fault(comparison, rotation_now(readings), readings, its.R_c, correction.reading_noise_rad);
  use_all_the_same(correction, report);
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::update(Correction& correction, const Seen& its, const StarFix& fix,
                                           const FixReadings& readings, const FixReport& report) {
  Compared rows = rows_to_use(compared(its, correction, readings), its.R_c, correction.reading_noise_rad,
                              readings.noise_factor, fixes_sharing_samples_of(fix));
  errors_.see_through_uncertainty(states_of(rows));
  use(correction, fix, rows, report.weight);
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::use(Correction& correction, const StarFix& fix, Compared& seen, double weight) {
  angles_since_fix_ = 0;
  used_fix_t_[static_cast<std::size_t>(fix.head)] = fix.t;
  if (weight < 1) {
    seen *= std::sqrt(weight);
  }
  errors_.take(rows_of(seen));
  correction.stage = Correction::Stage::kFeedback;
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::take_angles(Correction& correction, const FixReadings& readings,
                                                AngleReport& report) {
  using Stage = typename Correction::Stage;
  switch (correction.stage) {
    case Stage::kBegin:
      if (gives_attitude(gyros_, readings.h_b, readings.used)) {
        correction.stage = Stage::kSecondOrder;
      } else {
        report.status = FixStatus::kRejectedGeometry;
        correction.stage = Stage::kDone;
      }
      break;
    case Stage::kSecondOrder:
      // After angles an attitude has not been seen for long: nothing is held.
      second_order_.hold_s = 0;
      follow_alignments(readings);
      look_at_second_order(readings);
      correction.prediction_noise_rad = prediction_noise(rotation_now(readings));
      correction.stage = Stage::kPropagation;
      break;
    case Stage::kPropagation:
      propagate(correction.prediction_noise_rad);
      correction.stage = Stage::kNoise;
      break;
    case Stage::kNoise:
      correction.reading_noise_rad = reading_noise(rotation_now(readings), readings.noise_factor, ++angles_since_fix_);
      correction.stage = Stage::kJudgement;
      break;
    case Stage::kJudgement:
      judge_angles(correction, readings, report);
      break;
    default:
      correction.stage = Stage::kDone;
      break;
  }
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::judge_angles(Correction& correction, const FixReadings& readings,
                                                 AngleReport& report) {
  correction.stage = Correction::Stage::kDone;
  const Eigen::Matrix3d C_in_c = rotation_now(readings);
  FixComparison comparison = compare(layout(), gyros_, C_in_c, C_in_c, readings.h_b, readings.used,
                                     FixBySharedStates::Zero(3, layout().shared_size()));
  White white = angles_of(comparison, correction.reading_noise_rad);
  report.nis = white.nis;
  if (!(white.nis <= gate_of_freedom(comparison.components() - 3, setup_.gate_nis))) {
    report.status = FixStatus::kRejectedByGate;
    if (count(readings.used) > 2 && is_fault(report.nis, detail::misfit_rad(comparison), count(readings.used))) {
      report.odd_gyro = odd_gyro(comparison, [&](const FixComparison& rest) {
        return angles_of(rest, correction.reading_noise_rad).nis <=
               gate_of_freedom(rest.components() - 3, setup_.gate_nis);
      });
    }
    report.rejections_in_a_row = ++angle_rejections_in_a_row_;
    return;
  }
  report.status = FixStatus::kUsed;
  angle_rejections_in_a_row_ = 0;
  errors_.take(rows_of(white.seen));
  feed_back();
}

template <Capacity kCapacity>
void InvariantEstimator<kCapacity>::feed_back() {
  const Vector x = errors_.correction();
  const Layout& layout = setup_.layout;
  for (int k = 0; k < layout.gyros; ++k) {
    Gyro& gyro = gyros_[k];
    gyro.h_in = rotated<double>(gyro.h_in, Eigen::Vector3d(x.template segment<3>(layout.direction(k)))).normalized();
    if (layout.further.wandering_drift) {
      gyro.drift_rad_s.template segment<3>(layout.wandering_column()) += x.template segment<3>(layout.wandering(k));
    }
    add_parameter_errors(layout, k, x, gyro);
  }
  shared_ += x.tail(layout.shared_size());
}

}  // namespace trihedron
