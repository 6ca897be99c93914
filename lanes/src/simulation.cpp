#include "simulation.hpp"

#include <algorithm>

#include "elements.hpp"

namespace trihedron::lanes {

Simulation::Simulation(std::span<Lane* const> lanes, const Kernels& kernels)
    : lanes_(lanes), kernels_(kernels), period_(lanes.front()->scenario->gyro_period) {
  put_reference();
  put_jitter();
  for (std::size_t i = 0; i < kWidth; ++i) {
    attitude_.turns_per_s[i] = attitude_.turn_from.w[i] = 1;
  }
  put_gyros();
  for (std::size_t k = 0; k < kGyros; ++k) {
    noise_[k].resize(kNoiseTogether);
    points_[k].resize(3 * kNoiseTogether / 2);
  }
}

void Simulation::put_reference() {
  std::size_t most = 0;
  for (const Lane* its : lanes_) {
    most = std::max(most, its->attitude.reference()->values().size());
  }
  nodes_.resize(most);
  for (std::size_t i = 0; i < kWidth; ++i) {
    const sim::AttitudeSpline& its = *lane(i).attitude.reference();
    const std::size_t count = its.values().size();
    for (std::size_t node = 0; node < count; ++node) {
      for (int k = 0; k < 4; ++k) {
        put(its.values()[node](k), i, nodes_[node].value[k]);
        put(its.second_derivatives()[node](k), i, nodes_[node].second[k]);
      }
    }
    attitude_.begin_s[i] = its.begin_s();
    attitude_.spacing_s[i] = (its.end_s() - its.begin_s()) / static_cast<double>(count - 1);
    attitude_.is_together = attitude_.is_together && attitude_.begin_s[i] == attitude_.begin_s[0] &&
                            attitude_.spacing_s[i] == attitude_.spacing_s[0];
  }
  attitude_.nodes = nodes_.data();
  attitude_.node_count = static_cast<int>(most);
}

void Simulation::put_jitter() {
  if (!lanes_.front()->attitude.jitter()) {
    return;
  }
  std::size_t most = 0;
  for (const Lane* its : lanes_) {
    most = std::max(most, its->attitude.jitter()->coefficients().size());
  }
  jitter_.resize(most);
  for (std::size_t i = 0; i < kWidth; ++i) {
    const sim::AttitudeProgramme& its = lane(i).attitude;
    const std::vector<Eigen::Vector3d>& coefficients = its.jitter()->coefficients();
    for (std::size_t knot = 0; knot < coefficients.size(); ++knot) {
      put(coefficients[knot], i, jitter_[knot]);
    }
    attitude_.jitter_rad[i] = its.jitter_rad();
    attitude_.jitter_begin_s[i] = its.jitter()->begin_s();
    attitude_.is_together = attitude_.is_together && attitude_.jitter_begin_s[i] == attitude_.jitter_begin_s[0];
  }
  attitude_.jitter = jitter_.data();
  attitude_.jitter_count = static_cast<int>(most);
  attitude_.jitter_knots_per_s = lanes_.front()->attitude.jitter()->knots_per_s();
}

void Simulation::put_gyros() {
  for (std::size_t i = 0; i < kWidth; ++i) {
    for (std::size_t k = 0; k < kGyros; ++k) {
      const sim::Gyro& gyro = lane(i).gyros[k];
      const ReadoutScenario& readout = lane(i).scenario->gyros[k].readout;
      TrueGyro& its = gyros_[k];
      for (int c = 0; c < kCoefficients; ++c) {
        its.kappa_rad_s[c][i] = gyro.drift().kappa_rad_s()(c);
      }
      put(gyro.alignment().raw(), i, its.C_c_b);
      put(gyro.momentum().raw(), i, its.h_in);
      put(gyro.momentum_in_case().raw(), i, its.h_b);
      put(Eigen::Vector3d(Eigen::Vector3d::Ones() + readout.scale), i, its.one_and_scale);
      put(readout.bias_rad, i, its.bias);
      its.noise[i] = readout.noise_rad;
    }
  }
}

void Simulation::turn_begins(std::size_t i, const sim::SlewPlan::Turn& turn) {
  attitude_.turn_begin_s[i] = turn.begin_s;
  attitude_.turns_per_s[i] = 1 / (turn.end_s - turn.begin_s);
  put(turn.from.vec(), i, attitude_.turn_from.v);
  attitude_.turn_from.w[i] = turn.from.w();
  put(turn.rotation_vector_rad, i, attitude_.turn_rad);
}

/// Those that have begun by this time.
void Simulation::look_for_turns(double t_s) {
  if (t_s < next_turn_s_) {
    return;
  }
  next_turn_s_ = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < kWidth; ++i) {
    const auto& turns = lane(i).attitude.slews().turns();
    std::size_t& begun = turns_begun_[i];
    while (begun < turns.size() && turns[begun].begin_s <= t_s) {
      turn_begins(i, turns[begun++]);
    }
    if (begun < turns.size()) {
      next_turn_s_ = std::min(next_turn_s_, turns[begun].begin_s);
    }
  }
}

void Simulation::attitude_at(double t_s, M3& C_in_c) {
  look_for_turns(t_s);
  kernels_.attitude(attitude_, t_s, C_in_c);
}

void Simulation::next(V3 (&h_b)[kGyros]) {
  const double t_s = to_seconds(since_);
  const double step_s = to_seconds(period_);
  if (!has_begun_) {
    has_begun_ = true;
    attitude_at(t_s, end_);
    for (std::size_t i = 0; i < kWidth; ++i) {
      for (TrueGyro& its : gyros_) {
        put(matrix_of(end_, i) * matrix_of(its.C_c_b, i), i, its.C_in_b);
      }
    }
  } else {
    M3 middle;
    attitude_at(t_s + step_s / 2, middle);
    attitude_at(t_s + step_s, end_);
    kernels_.turn_momenta(gyros_, step_s, middle, end_);
    since_ += period_;
  }
  if (noise_used_ == kNoiseTogether) {
    make_noise();
  }
  const V3 noise[kGyros] = {noise_[0][noise_used_], noise_[1][noise_used_]};
  ++noise_used_;
  kernels_.read(gyros_, noise, h_b);
}

/// Of the next samples, so many that they use whole pairs.
void Simulation::make_noise() {
  constexpr std::size_t kPoints = 3 * kNoiseTogether / 2;
  std::array<std::array<sim::Stream::InCircle, kPoints>, kGyros> of_lane;
  for (auto& points : of_lane) {
    points.fill({0, 0, 0.5});  // of a lane in which nothing flies
  }
  for (std::size_t i = 0; i < kWidth; ++i) {
    if (i < lanes_.size()) {
      std::vector<sim::Stream>& streams = lanes_[i]->readout_noise;
      sim::Stream::fill_both(streams[0], of_lane[0], streams[1], of_lane[1]);
    }
    for (std::size_t k = 0; k < kGyros; ++k) {
      for (std::size_t point = 0; point < kPoints; ++point) {
        put(of_lane[k][point].x, i, points_[k][point].x);
        put(of_lane[k][point].y, i, points_[k][point].y);
        put(of_lane[k][point].square, i, points_[k][point].square);
      }
    }
  }
  for (std::size_t k = 0; k < kGyros; ++k) {
    kernels_.make_normal(points_[k].data(), static_cast<int>(kPoints), &noise_[k][0].x);
  }
  noise_used_ = 0;
}
}  // namespace trihedron::lanes
