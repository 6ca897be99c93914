#pragma once
/// Noise of what changes smoothly while the body turns evenly.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "trihedron/records/units.hpp"

namespace trihedron::ground {

/// Times at which something was seen, and the fourth differences x_0 − 4 x_1 + 6 x_2 − 4 x_3 + x_4 of it at five of
/// them that are evenly apart, over which the body turns as for most of the ten minutes around: what the gyros drift is
/// not in them. Where the errors of x at these five are independent, the variance of such a difference is kSquares
/// times theirs.
class AtRest {
 public:
  static constexpr double kSquares = 1 + 16 + 36 + 16 + 1;
  /// Five times evenly apart.
  using Five = std::array<std::size_t, 5>;
  /// Fewer differences tell nothing.
  static constexpr std::size_t kFewest = 500;
  /// 1-sigma of a variance, as a part of it, by one of differences that overlap: √(2 (1 + 2 Σ ρ²)).
  static constexpr double kChanceOfOne = 2.3;

  template <class Value>
  [[nodiscard]] static Value fourth_difference(const std::array<Value, 5>& x) {
    return x[0] + x[4] - 4 * (x[1] + x[3]) + 6 * x[2];
  }

  /// Whether what has changed so while the body turned by so much may be that of alignments and noise. More is a star
  /// tracker that is frozen, or axes that are exchanged.
  [[nodiscard]] static bool may_be_alignment(double change_rad, double turned_rad) {
    constexpr double kNoise_rad = 1.5e-3;  // 5′
    constexpr double kAlignment_rad = 0.2;
    return change_rad < kNoise_rad + kAlignment_rad * turned_rad;
  }

  void add(double t_s, const Eigen::Vector3d& rate_rad_s) {
    t_s_.push_back(t_s);
    rates_rad_s_.insert(rates_rad_s_.end(), rate_rad_s.begin(), rate_rad_s.end());
  }
  /// When all times are added.
  void settle();

  /// Median of the times from one to the next; 0 where there are too few.
  [[nodiscard]] double step_s() const { return step_s_; }
  /// Times further apart are not compared.
  [[nodiscard]] double farthest_s() const { return farthest_s_; }

  /// Calls take(Five) for all five times `lag` steps apart, or for enough of them.
  template <class Take>
  void for_each_five(std::size_t lag, const Take& take) const {
    constexpr std::size_t kEnough = 5000;
    constexpr double kEven = 0.25;  // steps
    const double lag_s = static_cast<double>(lag) * step_s_;
    if (in_motion_.empty() || lag_s > farthest_s_) {
      return;
    }
    const std::size_t every = t_s_.size() / kEnough + 1;
    Five five{};
    for (std::size_t i = 0; i < t_s_.size(); i += every) {
      bool is_even = true;
      for (std::size_t n = 0; n < five.size() && is_even; ++n) {
        const double wanted_s = t_s_[i] + static_cast<double>(n) * lag_s;
        five[n] = std::max(five[n], i);
        while (five[n] < t_s_.size() && t_s_[five[n]] < wanted_s - kEven * step_s_) {
          ++five[n];
        }
        is_even = five[n] < t_s_.size() && t_s_[five[n]] <= wanted_s + kEven * step_s_;
      }
      if (is_even && in_motion_[five.front()] == in_motion_[five.back() + 1]) {
        take(five);
      }
    }
  }

 private:
  static constexpr double kFarthest_s = 240;
  static constexpr double kFarthestTurn_rad = 0.2;
  // By vectors: a slow slew against the turn of the orbit changes the size of the rate by little.
  static constexpr double kSlowest_rad_s = 0.01 * kDegree;
  static constexpr double kPartOfUsual = 0.2;
  static constexpr double kStretch_s = 600;  ///< of which a rate is the usual one

  std::vector<double> t_s_;
  std::vector<double> rates_rad_s_;     ///< of the body, three for each time
  std::vector<std::size_t> in_motion_;  ///< times before each, and all, at which the body turns otherwise
  double step_s_ = 0;
  double farthest_s_ = 0;
};

/// 1-sigmas of fourth differences that were taken about `axes` axes in turn, less what they have of the alignments of
/// least squares, which a body that wobbles shows. `by_alignments`: how rad of each change the differences. Outliers do
/// not count. Needs differences.
[[nodiscard]] Eigen::ArrayXd sigmas_less_alignments(Eigen::VectorXd differences, Eigen::MatrixXd by_alignments,
                                                    Eigen::Index axes);

}  // namespace trihedron::ground
