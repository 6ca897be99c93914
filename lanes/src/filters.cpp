#include "filters.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "elements.hpp"
#include "trihedron/core/readings.hpp"

namespace trihedron::lanes {

Filters::Filters(std::span<Lane* const> lanes, const Kernels& kernels)
    : lanes_(lanes), kernels_(kernels), reach_(lanes.front()->estimator->setup().reach()) {
  for (std::size_t i = 0; i < kWidth; ++i) {
    const Lane::Estimator& estimator = *lanes_[std::min(i, lanes_.size() - 1)]->estimator;
    const CalibrationSetup& setup = estimator.setup();
    for (int state = 0; state < kStates; ++state) {
      filter_->root[state * (kStates + 1)][i] = 1;
    }
    put(setup.star_trackers[0].noise_rad.cwiseAbs2(), i, filter_->fix_variance_rad2);
    filter_->direction_random_walk_rad_sqrt_s[i] = setup.direction_random_walk_rad_sqrt_s;
    for (int k = 0; k < kGyros; ++k) {
      filter_->readout_noise_rad[k][i] = setup.readout_noise_rad[k];
      put(Eigen::Vector3d::Unit(k), i, filter_->gyro[k].h_in);
      put(estimator.prior_gyros()[k].C_c_b, i, filter_->gyro[k].C_c_b);
      for (int j = 0; j < 3; ++j) {
        put(Eigen::Vector3d::Unit(j), i, filter_->since_fix[k].by_start[j]);
      }
    }
  }
}

void Filters::predict(const V3 (&h_b)[kGyros], double dt_s) {
  kernels_.predict(*filter_, h_b, dt_s);
  for (State& its : states_) {
    its.gate.elapse(dt_s);
  }
}

/// That of the lane at this time; false where there is none.
bool Filters::take_fix(const Lane& lane, State& its, Time t, StarFix& fix) {
  const StarTrackerTelemetry& fixes = lane.fixes;
  if (its.has_left || its.next_fix >= fixes.t.size() || fixes.t[its.next_fix] != t) {
    return false;
  }
  fix.t = t;
  fix.q_in_c = fixes.q_in_c[its.next_fix++];
  return true;
}

/// Where no polynomial explains the samples around a fix: whether the reading of neither gyro is left out as a spike.
bool Filters::uses_both_readings(std::size_t i, Time t, const SamplesAround& samples) const {
  const Lane::Estimator& estimator = *lanes_[i]->estimator;
  Lane::Estimator::Gyros gyros = estimator.prior_gyros();
  Readings<kGyros> readings(estimator.setup(), true);
  for (int k = 0; k < kGyros; ++k) {
    gyros[k].h_in = vector_of(filter_->gyro[k].h_in, i);
    gyros[k].C_c_b = matrix_of(filter_->gyro[k].C_c_b, i);
  }
  for (int sample = samples.first; sample <= samples.last; ++sample) {
    GyroSample its;
    its.t = t + sample * samples.period;
    for (int k = 0; k < kGyros; ++k) {
      its.h_b[k] = vector_of(samples.at(sample)[k], i);
    }
    readings.push(its);
  }
  const GyroHealth<kGyros> health(kGyros);
  const auto at = readings.at(t, estimator.setup(), health, gyros);
  return at && at->used[0] && at->used[1];
}

/// The first fix of a lane, by its own estimator.
void Filters::start(std::size_t i, const StarFix& fix, const Fix& all) {
  State& its = states_[i];
  FixReadings readings;
  for (int k = 0; k < kGyros; ++k) {
    readings.h_b[k] = vector_of(all.readings.h_b[k], i);
    readings.used[k] = true;
  }
  readings.noise_factor = all.readings.noise_factor[i];
  readings.jitter_rad2 = static_cast<float>(all.jitter_rad2[i]);
  readings.rate_c = vector_of(all.readings.rate_c, i);
  its.has_started = lanes_[i]->estimator->correct(fix, readings).status == FixStatus::kStarted;
  its.has_left = !its.has_started;
  its.used_t = fix.t;
  if (its.has_started) {
    load(i, all);
  }
}

void Filters::load(std::size_t i, const Fix& all) {
  const Lane::Estimator& estimator = *lanes_[i]->estimator;
  const ConstRowsView root = estimator.errors().root();
  for (int row = 0; row < kStates; ++row) {
    for (int column = 0; column < kStates; ++column) {
      filter_->root[row * kStates + column][i] = root(row, column);
    }
  }
  filter_->time_since_fix_s[i] = 0;
  for (int k = 0; k < kGyros; ++k) {
    const auto& gyro = estimator.gyros()[k];
    put(gyro.h_in, i, filter_->gyro[k].h_in);
    put(gyro.C_c_b, i, filter_->gyro[k].C_c_b);
    for (int c = 0; c < kCoefficients; ++c) {
      filter_->gyro[k].kappa_rad_s[c][i] = gyro.drift_rad_s(c);
      put(Eigen::Vector3d::Zero(), i, filter_->since_fix[k].by_drift[c]);
    }
    for (int j = 0; j < 3; ++j) {
      put(Eigen::Vector3d::Unit(j), i, filter_->since_fix[k].by_start[j]);
      put(Eigen::Vector3d::Zero(), i, filter_->since_fix[k].by_alignment[j]);
    }
    const Eigen::Vector3d h_b = vector_of(all.readings.h_b[k], i);
    put(h_b, i, filter_->h_b[k]);
    put(Eigen::Vector3d(h_b.cast<float>().cast<double>()), i, filter_->h_b_at_fix[k]);
  }
}

/// In an outage of the star tracker the angles between the momenta would be used; momenta that come near to one line
/// give no attitude.
void Filters::leave_by_time_or_geometry(std::size_t i, Time t) {
  constexpr double kLeastSine = 2 * kMinSine;
  State& its = states_[i];
  const Duration longest = lanes_[i]->estimator->setup().angles_after;
  const bool is_late = its.has_started && longest != CalibrationSetup::kNever && t - its.used_t >= longest;
  its.has_left = its.has_left || is_late || !(fix_->readings.sine_square[i] > kLeastSine * kLeastSine);
}

/// Whether the gate takes the fix of a lane. It leaves where more than that happens: after so many rejections it would
/// matter that the gate is not told whether the gyros contradict each other. Nor is a fix that is far off compared
/// exactly.
void Filters::judge(std::size_t i, Time t, Fix& fix) {
  constexpr double kFarthest_rad = 0.1;
  State& its = states_[i];
  const CalibrationSetup& setup = lanes_[i]->estimator->setup();
  const double nis = fix.nis[i];
  const FixStatus status = its.gate.judge(setup, nis, fix.misfit_rad[i]);
  const bool is_used = status == FixStatus::kUsed;
  const bool is_rejected =
      status == FixStatus::kRejectedByGate && its.gate.rejections_in_a_row() + 1 < setup.reopen_after_rejections;
  its.has_left = !(is_used || is_rejected) || !std::isfinite(nis) || !(fix.apart_rad[i] < kFarthest_rad);
  fix.is_used[i] = is_used ? 1 : 0;
  ++its.result.fixes_judged;
  its.result.nis_sum_of_judged += nis;
  if (is_used) {
    ++its.result.fixes_used;
    its.result.nis_sum += nis;
    its.used_t = t;
  }
}

void Filters::fix(Time t, const Fit& fit, const SamplesAround& samples, const M3& truth) {
  Fix& all = *fix_;
  kernels_.fit(*filter_, fit, samples.of_fix->h_b, all.readings);
  V is_corrected{};
  V counts{};
  bool corrects_all = lanes_.size() == kWidth;
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    State& its = states_[i];
    leave_by_time_or_geometry(i, t);
    StarFix fix;
    const bool has_fix = take_fix(*lanes_[i], its, t, fix);
    if (has_fix && !(all.readings.is_explained[i] > 0) && !uses_both_readings(i, t, samples)) {
      its.has_left = true;
      continue;
    }
    put(fix.q_in_c.normalized().toRotationMatrix(), i, all.C_in_c);
    if (has_fix) {
      const FittedReadings& readings = all.readings;
      its.jitter.add(t, reach_, {readings.unfollowed_square_rad2[i], readings.unfollowed_sigma_rad2[i]});
      all.jitter_rad2[i] = readings.noise_factor[i] < 1 ? static_cast<double>(its.jitter.square_rad2()) : 0;
      is_corrected[i] = its.has_started ? 1 : 0;
      if (!its.has_started) {
        start(i, fix, all);
      }
      counts[i] = its.has_started ? 1 : 0;
    }
    corrects_all = corrects_all && is_corrected[i] > 0;
  }
  if (!corrects_all) {
    *before_ = *filter_;
  }
  all.is_used = V{};
  kernels_.begin_fix(*filter_, all);
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    if (is_corrected[i] > 0) {
      judge(i, t, all);
    }
  }
  kernels_.finish_fix(*filter_, all);
  kernels_.add_error(all, truth, counts, errors_);
  if (!corrects_all) {
    kernels_.blend(*filter_, *before_, is_corrected);
  }
  leave_by_drift();
}

/// Where the estimates turn a momentum by more than is exact.
void Filters::leave_by_drift() {
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    for (const Gyro& gyro : filter_->gyro) {
      double most_rad_s = 0;
      for (const V& kappa : gyro.kappa_rad_s) {
        most_rad_s += std::abs(kappa[i]);
      }
      const double most_rad = most_rad_s * to_seconds(lanes_[i]->scenario->gyro_period);
      states_[i].has_left = states_[i].has_left || !(most_rad < kLittle_rad);
    }
  }
}

/// Angles would be used as well if they are due before the last samples.
void Filters::end(Time t) {
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    leave_by_time_or_geometry(i, t - 3 * reach_);
  }
}

bool Filters::have_all_left() const {
  return std::all_of(states_.begin(), states_.begin() + static_cast<std::ptrdiff_t>(lanes_.size()),
                     [](const State& its) { return its.has_left; });
}

std::optional<FilterResult> Filters::result(std::size_t i) const {
  const State& its = states_[i];
  if (its.has_left || !its.has_started) {
    return std::nullopt;
  }
  FilterResult result = its.result;
  Eigen::Matrix<double, kConstants, kConstants> root;
  for (int row = 0; row < kConstants; ++row) {
    for (int column = 0; column < kConstants; ++column) {
      root(row, column) = filter_->root[(kMoving + row) * kStates + kMoving + column][i];
    }
  }
  result.covariance = root * root.transpose();
  result.error.resize(kConstants);
  for (int k = 0; k < kGyros; ++k) {
    const sim::Gyro& truth = lanes_[i]->gyros[static_cast<std::size_t>(k)];
    for (int c = 0; c < kCoefficients; ++c) {
      result.error(drift_of(k) - kMoving + c) = filter_->gyro[k].kappa_rad_s[c][i] - truth.drift().kappa_rad_s()(c);
    }
    const Eigen::Matrix3d C_c_b = matrix_of(filter_->gyro[k].C_c_b, i);
    result.error.segment<3>(alignment_of(k) - kMoving) =
        Rot<C, C>::assume(Eigen::Matrix3d(C_c_b * truth.alignment().raw().transpose())).log().raw();
  }
  const double count = errors_.count[i];
  result.attitude_rms_rad = (vector_of(errors_.squares_rad2, i) / count).cwiseSqrt();
  result.attitude_normalised_square = errors_.normalised[i] / count;
  const bool is_sound =
      result.error.allFinite() && result.covariance.allFinite() && result.attitude_rms_rad.allFinite();
  return is_sound ? std::optional(std::move(result)) : std::nullopt;
}
}  // namespace trihedron::lanes
