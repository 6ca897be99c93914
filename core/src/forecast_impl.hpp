#pragma once
/// Definitions of Forecast.

#include <Eigen/Geometry>
#include <limits>

#include "trihedron/core/forecast.hpp"

namespace trihedron {

template <class Estimator>
void Forecast<Estimator>::extend(OnBoard<Estimator>& on_board, const Eigen::Matrix3d& C_in_c) {
  const double flying_s = on_board.stretch().duration_s;
  if (attitudes_ < kAttitudes && flying_s >= window_s_ * attitudes_ / kAttitudes) {
    const Eigen::Quaterniond q(C_in_c);
    q_in_c_[static_cast<std::size_t>(attitudes_++)] = {q.x(), q.y(), q.z(), q.w()};
  }
  if (attitudes_ == kAttitudes && flying_s >= window_s_) {
    flown_ = on_board.stretch();
    on_board.begin_stretch();
    attitudes_ = 0;
  }
}

template <class Estimator>
void Forecast<Estimator>::predict(const Estimator& estimator, const GyroMask& used) {
  if (!(flown_.duration_s > 0) || !estimator.errors().regular()) {
    return;
  }
  const auto place = static_cast<std::size_t>(next_);
  const Eigen::Matrix3d C_in_c = Eigen::Quaterniond(q_in_c_[place].data()).toRotationMatrix();
  const Layout& layout = estimator.layout();
  const typename Estimator::Gyros& gyros = estimator.gyros();
  Directions h_b;
  for (int k = 0; k < layout.gyros; ++k) {
    h_b[k] = gyros[k].reading_of(C_in_c.transpose() * gyros[k].h_in).normalized();
  }
  next_ = (next_ + 1) % kAttitudes;
  predicted_ = std::min(predicted_ + 1, kAttitudes);
  const auto attitude = estimator.attitude(gyros, h_b, used);
  if (!attitude) {
    error_by_attitude_rad_[place] = std::numeric_limits<double>::infinity();
    ready_by_attitude_s_[place] = 0;
    return;
  }
  // The rows are a + x g of what is flown x windows ahead, their covariance A + x B + x² G; with x = t over the window,
  // the noise of the readings and the walk it is now + t linear + t² quadratic.
  using Rows3 = StateRows3<Estimator::kMaxStates>;
  Rows3 a = attitude_by_states_now<Estimator::kMaxStates>(layout, attitude.value(), gyros, h_b);
  Rows3 g = a;
  carry_back(layout, flown_.sensitivities, g);
  g -= a;
  estimator.errors().see_through_uncertainty(rows_of(a));
  estimator.errors().see_through_uncertainty(rows_of(g));
  const CalibrationSetup& setup = estimator.setup();
  const Eigen::Matrix3d now =
      with_covariance(attitude.value(), gram<Estimator::kMaxStates>(a), setup.readout_noise_rad, layout.gyros, 0)
          .covariance_rad2;
  const Eigen::Matrix3d a_g = a.lazyProduct(g.transpose()) / flown_.duration_s;
  const double walk = setup.direction_random_walk_rad_sqrt_s;
  const Eigen::Matrix3d linear =
      with_covariance(attitude.value(), a_g + a_g.transpose(), {}, layout.gyros, walk * walk).covariance_rad2;
  const Eigen::Matrix3d quadratic = gram<Estimator::kMaxStates>(g) / (flown_.duration_s * flown_.duration_s);
  const auto error_after_rad = [&](double time_s) {
    return error_997_rad(now + time_s * (linear + time_s * quadratic));
  };
  error_by_attitude_rad_[place] = error_after_rad(interval_s_);
  // By bisection: from some time on the error only grows.
  constexpr int kHalvings = 12;
  double ready_s = 0;
  double step_s = kFarthest * interval_s_ / 2;
  for (int i = 0; i < kHalvings; ++i, step_s /= 2) {
    if (error_after_rad(ready_s + step_s) <= error_rad_) {
      ready_s += step_s;
    }
  }
  ready_by_attitude_s_[place] = ready_s;
}

}  // namespace trihedron
