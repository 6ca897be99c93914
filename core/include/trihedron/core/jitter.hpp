#pragma once
/// What the body does beside the polynomials through the readings of its gyros.

#include <algorithm>
#include <cmath>

#include "trihedron/core/time.hpp"

namespace trihedron {

/// Of one polynomial: mean square, about each axis, of the motion that it does not follow, less what noise makes of
/// that, rad²; and its 1-sigma by chance, 0 where nothing is known of it.
struct UnfollowedMotion {
  double square_rad2 = 0;
  double sigma_rad2 = 0;
};

/// The same in the mean of the latest polynomials, each counting for one percent.
class Jitter {
 public:
  /// Of the polynomial about time t, over samples so far to both sides of it; those that share samples with the last
  /// one say nothing more.
  void add(Time t, Duration reach, const UnfollowedMotion& seen) {
    if (!(seen.sigma_rad2 > 0) || (count_ > 0 && t > latest_t_ && t - latest_t_ < 2 * reach)) {
      return;
    }
    latest_t_ = t;
    count_ = std::min(count_ + 1, kMemory);
    const float part = 1 / static_cast<float>(count_);
    const auto sigma_rad2 = static_cast<float>(seen.sigma_rad2);
    // One in which the body began to turn is no jitter.
    const float square_rad2 = std::min(static_cast<float>(seen.square_rad2), kMostSigmas * sigma_rad2);
    mean_rad2_ += part * (square_rad2 - mean_rad2_);
    const float before = (1 - part) * sigma_rad2_;
    const float its = part * sigma_rad2;
    sigma_rad2_ = std::sqrt(before * before + its * its);
  }
  /// About each axis, rad²; 0 where chance may have made it.
  [[nodiscard]] float square_rad2() const { return mean_rad2_ > kSureSigmas * sigma_rad2_ ? mean_rad2_ : 0; }

 private:
  static constexpr int kMemory = 100;
  static constexpr float kMostSigmas = 4;
  static constexpr float kSureSigmas = 3;

  Time latest_t_{};
  float mean_rad2_ = 0;
  float sigma_rad2_ = 0;  ///< of the mean
  int count_ = 0;
};

}  // namespace trihedron
