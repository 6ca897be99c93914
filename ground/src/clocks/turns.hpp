#pragma once
/// Turns of the body as fixes and as gyros tell them, from which the clocks are found.

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Offsets are searched up to here.
inline constexpr double kFarthestOffset_s = 600;
/// A residual beyond this many sigmas is not used: an outlier of the star tracker, a spike of a gyro.
inline constexpr double kGate = 5;
/// The fewest pairs of fixes from which anything is told.
inline constexpr std::size_t kLeastPairs = 50;

/// Gyro readings in c axes by the alignments known before the pass.
class GyroReadings {
 public:
  explicit GyroReadings(const Pass& pass);

  [[nodiscard]] int gyros() const { return gyros_; }
  [[nodiscard]] std::size_t size() const { return pass_.gyro.size(); }
  [[nodiscard]] Time t(std::size_t i) const { return pass_.gyro.t[i]; }
  /// To both sides of a time, the samples that at() takes.
  [[nodiscard]] Duration reach() const { return reach_; }

  /// Variance of the rates of at() over that of a single reading, 1/s²: that of the slope of a parabola.
  [[nodiscard]] double rate_variance() const {
    const double reach_s = to_seconds(reach_);
    return 3 / ((2 * reach_s / to_seconds(pass_.settings.gyro_period) + 1) * reach_s * reach_s);
  }

  /// B(h) of eq. (1), c axes.
  [[nodiscard]] Esg7::Basis<double> drift_basis(int gyro, const Eigen::Vector3d& h_c) const {
    return C_c_b_[gyro] * Esg7::basis<double>(C_c_b_[gyro].transpose() * h_c);
  }

  /// Of one gyro in one sample; nothing where it is none.
  [[nodiscard]] std::optional<Eigen::Vector3d> reading(std::size_t i, int gyro) const;
  /// One sample; nothing where a reading is none.
  [[nodiscard]] std::optional<Directions> sample(std::size_t i) const;

  /// The sample at `t` or the first after it, within reach().
  [[nodiscard]] std::optional<Directions> near(Time t) const;

  /// By a parabola through the samples around `t`, with rates. Asked for with times that mostly increase: `from` is
  /// where the samples were the last time.
  [[nodiscard]] std::optional<FittedDirections> at(Time t, std::size_t& from) const;

 private:
  const Pass& pass_;
  int gyros_;
  PerGyro<Eigen::Matrix3d> C_c_b_;
  Duration reach_{};
  int least_samples_ = 0;
};

/// Two fixes some time apart, and the turn of the body between them in c: C(first)ᵀ C(second).
struct Turn {
  Time first{};
  Time second{};
  std::size_t first_fix = 0;
  std::size_t second_fix = 0;
  Eigen::Matrix3d C_first_second;
  double angle_rad = 0;
};

/// Of each fix with the one about `lag_s` later.
[[nodiscard]] std::vector<Turn> turns_of(const StarTrackerTelemetry& fixes, double lag_s);

/// Of all axes of all gyros, 0.1 rad at most.
[[nodiscard]] double largest_alignment_sigma(const PassSettings& settings);

/// Axes that two directions span, as columns.
[[nodiscard]] Eigen::Matrix3d triad(const Eigen::Vector3d& h1, const Eigen::Vector3d& h2);

/// The offset at which the turns between consecutive fixes are most like those of the gyros, one of steps of one to two
/// times `finest_s`, or of a gyro's period; 0 where no offset is clearly better than any other.
[[nodiscard]] double rough_offset_s(const Pass& pass, const GyroReadings& readings, double finest_s);

}  // namespace trihedron::ground
