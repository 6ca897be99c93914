#pragma once
/// What attitude error the calibration predicts for an open loop: docs/adr/0014-on-board-application.md.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>

#include "trihedron/core/measurement.hpp"
#include "trihedron/core/on_board.hpp"

namespace trihedron {

/// The quantile of the length of an error with this covariance, rad, that a standard normal variable has at `normal`.
/// The square of the length is taken as a multiple of χ² with the same mean and variance (Satterthwaite 1946), whose
/// quantile is that of Wilson and Hilferty (1931).
[[nodiscard]] double error_quantile_rad(const Eigen::Matrix3d& covariance_rad2, double normal);

// Quantiles of a standard normal variable, one-sided.
inline constexpr double kNormal68 = 0.4677;
inline constexpr double kNormal95 = 1.6449;
inline constexpr double kNormal997 = 2.7478;

/// The length that an error with this covariance exceeds in 3 of 1000 cases, rad.
[[nodiscard]] inline double error_997_rad(const Eigen::Matrix3d& covariance_rad2) {
  return error_quantile_rad(covariance_rad2, kNormal997);
}

/// Takes it that in an open loop the body turns as it has turned in the last complete window, e.g. an orbit: the
/// sensitivities of that window times the time, over its length, and attitudes spread over it. The errors at the
/// beginning are those of the estimator at its last fix, so that the open loop begins with an astro-correction.
template <class Estimator>
class Forecast {
 public:
  /// Attitudes of a window.
  static constexpr int kAttitudes = 8;
  /// A readiness is not looked for beyond so many required intervals.
  static constexpr double kFarthest = 4;

  Forecast() = default;
  Forecast(Duration window, Duration interval, double error_rad)
      : window_s_(to_seconds(window)), interval_s_(to_seconds(interval)), error_rad_(error_rad) {}

  /// A fix has been used: the on-board step, whose stretch is taken when it makes a window, and the attitude now.
  void extend(OnBoard<Estimator>& on_board, const Eigen::Matrix3d& C_in_c);

  /// Predicts for one of the attitudes, another one at each call. Needs the states at their last fix: just after one
  /// has been used. `used`: the gyros.
  void predict(const Estimator& estimator, const GyroMask& used);

  /// Whether a window is complete and each of its attitudes has been predicted for.
  [[nodiscard]] bool known() const { return predicted_ >= kAttitudes; }
  /// The largest error after the required interval, 99.7 %.
  [[nodiscard]] double error_rad() const { return *std::ranges::max_element(error_by_attitude_rad_); }
  /// How long the required error is kept, 99.7 %.
  [[nodiscard]] double ready_s() const { return *std::ranges::min_element(ready_by_attitude_s_); }

 private:
  template <class T>
  using PerAttitude = std::array<T, static_cast<std::size_t>(kAttitudes)>;

  double window_s_ = 0;
  double interval_s_ = 0;
  double error_rad_ = 0;
  typename OnBoard<Estimator>::Stretch flown_;  ///< the last complete window
  PerAttitude<std::array<double, 4>> q_in_c_{};
  PerAttitude<double> error_by_attitude_rad_{};
  PerAttitude<double> ready_by_attitude_s_{};
  int attitudes_ = 0;  ///< kept of the window that is being flown
  int predicted_ = 0;  ///< since the first window was complete; not counted beyond kAttitudes
  int next_ = 0;
};

}  // namespace trihedron
