#include "calibrate/correlated_fixes.hpp"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "clocks/turns.hpp"
#include "model/scatter.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/records/units.hpp"

namespace trihedron::ground {
namespace {

/// Fixes further apart are not compared, nor those between which the body turns further: what the alignments are off
/// turns with it, and fourth differences no longer take it away.
constexpr double kFarthestCompared_s = 240;
constexpr double kFarthestTurn_rad = 0.2;
/// The body is at rest where its rate is so near to the usual one, or to this part of it.
constexpr double kSlowestTurn_rad_s = 0.01 * kDegree;
constexpr double kPartOfUsual = 0.2;
/// Fourth differences from which a variance is told, and those that are enough.
constexpr std::size_t kFewestFourths = 500;
constexpr std::size_t kEnoughFourths = 10000;

/// A fix beside the trihedron g of the first two momenta.
struct FixByGyros {
  double t_s;
  Eigen::Matrix3d C_in_c;  ///< by the fix
  Eigen::Matrix3d C_c_g;   ///< by the readings
};

/// About c x, y, z, by errors so far apart, from so many differences.
struct Variance {
  double lag_s;
  Eigen::Array3d rad2;
  std::size_t differences;
};

/// Errors of fixes against the gyros, while the body is at rest.
class ErrorsAtRest {
 public:
  ErrorsAtRest(const StarTrackerTelemetry& fixes, const GyroReadings& readings) {
    std::vector<double> rates_rad_s;
    std::size_t from = 0;
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      const std::optional<FittedDirections> fitted = readings.at(fixes.t[i], from);
      if (fitted && nearly_unit(fixes.q_in_c[i].norm())) {
        compared_.push_back({to_seconds(fixes.t[i] - fixes.t.front()), fixes.q_in_c[i].normalized().toRotationMatrix(),
                             triad(fitted->h_b[0], fitted->h_b[1])});
        const Eigen::Vector3d rate = rate_by_directions(fitted->h_b, fitted->h_b_rate, all_gyros(readings.gyros()));
        rates_rad_s.insert(rates_rad_s.end(), rate.begin(), rate.end());
      }
    }
    if (compared_.size() <= kFewestFourths) {
      return;
    }
    std::vector<double> steps_s;
    for (std::size_t i = 1; i < compared_.size(); ++i) {
      steps_s.push_back(compared_[i].t_s - compared_[i - 1].t_s);
    }
    step_s_ = median_of(steps_s);
    const auto columns = Eigen::Matrix3Xd::Map(rates_rad_s.data(), 3, std::ssize(compared_));
    const Eigen::Vector3d usual_rad_s = medians_of(columns);
    farthest_s_ = std::min(kFarthestCompared_s, kFarthestTurn_rad / usual_rad_s.norm());
    const double rest_rad_s = std::max(kSlowestTurn_rad_s, kPartOfUsual * usual_rad_s.norm());
    long in_motion = 0;
    for (Eigen::Index i = 0; i < columns.cols(); ++i) {
      in_motion += (columns.col(i) - usual_rad_s).norm() < rest_rad_s ? 0 : 1;
      in_motion_.push_back(in_motion);
    }
  }

  /// Between fixes; 0 where there are too few.
  [[nodiscard]] double step_s() const { return step_s_; }

  /// Of the errors of fixes so many steps apart, by their fourth differences: as far as these errors are alike it is
  /// less than theirs. Nothing where there are too few.
  [[nodiscard]] std::optional<Variance> variance(std::size_t lag) const {
    const std::size_t span = 4 * lag;
    if (compared_.size() <= span || static_cast<double>(lag) * step_s_ > farthest_s_) {
      return std::nullopt;
    }
    const std::size_t count = compared_.size() - span;
    const std::size_t every = count / kEnoughFourths + 1;
    std::array<std::vector<double>, 3> sizes;
    for (std::size_t i = 0; i < count; i += every) {
      if (in_motion_[i] == in_motion_[i + span] && is_even(i, lag)) {
        const Eigen::Array3d difference = fourth_difference(i, lag);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          sizes[axis].push_back(std::abs(difference(static_cast<Eigen::Index>(axis))));
        }
      }
    }
    if (sizes[0].size() < kFewestFourths) {
      return std::nullopt;
    }
    Variance found{static_cast<double>(lag) * step_s_, {}, sizes[0].size()};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double sigma = sigma_without_outliers(sizes[axis]);
      found.rad2(static_cast<Eigen::Index>(axis)) = sigma * sigma / (1 + 16 + 36 + 16 + 1);
    }
    return found;
  }

 private:
  [[nodiscard]] bool is_even(std::size_t i, std::size_t lag) const {
    constexpr double kEven = 0.25;  // steps
    for (std::size_t n = 0; n < 4; ++n) {
      const double apart_s = compared_[i + (n + 1) * lag].t_s - compared_[i + n * lag].t_s;
      if (std::abs(apart_s - static_cast<double>(lag) * step_s_) > kEven * step_s_) {
        return false;
      }
    }
    return true;
  }

  /// Of the rotation, c axes, from the attitude by the readings to that by each fix, both from the first fix on.
  [[nodiscard]] Eigen::Array3d fourth_difference(std::size_t i, std::size_t lag) const {
    constexpr double kBinomial[] = {1, -4, 6, -4, 1};
    const Eigen::Matrix3d C_g_in = (compared_[i].C_in_c * compared_[i].C_c_g).transpose();
    Eigen::Array3d sum = Eigen::Array3d::Zero();
    for (std::size_t n = 0; n < 5; ++n) {
      const FixByGyros& its = compared_[i + n * lag];
      const Eigen::Matrix3d off = its.C_c_g * C_g_in * its.C_in_c;
      sum += 0.5 * kBinomial[n] * Eigen::Array3d(off(2, 1) - off(1, 2), off(0, 2) - off(2, 0), off(1, 0) - off(0, 1));
    }
    return sum;
  }

  std::vector<FixByGyros> compared_;
  std::vector<long> in_motion_;  ///< fixes up to each, and with it, at which the body slews
  double step_s_ = 0;
  double farthest_s_ = 0;
};

/// How much less than theirs the variance by fourth differences is of errors with the correlation exp(−lag / τ).
double alike(double lag_over_time) {
  const double r = std::exp(-lag_over_time);
  return (112 * r - 56 * r * r + 16 * std::pow(r, 3) - 2 * std::pow(r, 4)) / (1 + 16 + 36 + 16 + 1);
}

/// Errors one part of which has the correlation exp(−lag / τ), and the rest none.
struct ErrorModel {
  double time_s = 0;                             ///< τ
  Eigen::Array3d part = Eigen::Array3d::Zero();  ///< of the variance about each axis, at most 1
  double misfit = std::numeric_limits<double>::infinity();
};

/// Least squares of relative differences from the variances by errors a lag apart.
ErrorModel model_with(double time_s, const std::vector<Variance>& variances) {
  const auto size = static_cast<Eigen::Index>(variances.size());
  ErrorModel model{time_s, Eigen::Array3d::Zero(), 0};
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::MatrixX2d parts(size, 2);
    Eigen::VectorXd weights(size);
    for (Eigen::Index i = 0; i < size; ++i) {
      const Variance& its = variances[static_cast<std::size_t>(i)];
      weights(i) = std::sqrt(static_cast<double>(its.differences));
      parts.row(i) << 1, -alike(its.lag_s / time_s);
      parts.row(i) *= weights(i) / its.rad2(axis);
    }
    const Eigen::Vector2d found = parts.colPivHouseholderQr().solve(weights);
    model.part(axis) = std::clamp(found(1) / found(0), 0.0, 1.0);
    model.misfit += (parts * found - weights).squaredNorm();
  }
  return model;
}

/// 1-sigma of a variance, as a part of it, by one of differences that overlap.
constexpr double kChanceOfOne = 2.3;

/// The most likely τ; nothing where it may as well be kLongest_s or more.
std::optional<ErrorModel> model_of(const std::vector<Variance>& variances) {
  constexpr double kLongest_s = 120;
  constexpr double kStep = 1.05;
  constexpr double kSure = 3;  // sigmas
  ErrorModel best;
  for (double time_s = variances.front().lag_s / 4; time_s < kLongest_s; time_s *= kStep) {
    const ErrorModel model = model_with(time_s, variances);
    best = model.misfit < best.misfit ? model : best;
  }
  const double more = model_with(kLongest_s, variances).misfit - best.misfit;
  return more > std::pow(kSure * kChanceOfOne, 2) ? std::optional(best) : std::nullopt;
}

/// Whether errors of fixes `near` each other differ less than those of fixes further apart, about one axis or all three
/// together, by more than chance makes of it.
bool are_correlated(const Variance& near, const Variance& far) {
  constexpr double kMore = 1.05;    // times the variance
  constexpr double kSure = 5;       // sigmas
  constexpr double kLeast = 1e-14;  // rad², a fiftieth of an arcsecond
  constexpr double kMost = 2e-6;    // rad², 5′: more is no noise, but axes that are exchanged
  const double chance =
      kChanceOfOne * std::sqrt(1 / static_cast<double>(near.differences) + 1 / static_cast<double>(far.differences));
  const Eigen::Array3d ratio = far.rad2 / near.rad2.max(kLeast);
  return (far.rad2 < kMost).all() &&
         (ratio.maxCoeff() > kMore + kSure * chance || ratio.mean() > kMore + kSure * chance / std::numbers::sqrt3);
}

std::optional<CorrelatedFixes> correlated(const StarTrackerTelemetry& fixes, const GyroReadings& readings) {
  constexpr double kLeft = 0.07;  // of the correlation, between fixes that are used
  const ErrorsAtRest errors(fixes, readings);
  if (!(errors.step_s() > 0)) {
    return std::nullopt;
  }
  // Fixes that share no reading.
  const auto first =
      static_cast<std::size_t>(std::max(std::ceil(2 * to_seconds(readings.reach()) / errors.step_s()), 1.0));
  const std::optional<Variance> near = errors.variance(first);
  const auto differ_less = [&](std::size_t lag) {
    const std::optional<Variance> far = errors.variance(lag);
    return far && are_correlated(*near, *far);
  };
  if (!near || !(differ_less(8 * first) || differ_less(32 * first))) {
    return std::nullopt;
  }
  std::vector<Variance> variances;
  for (std::size_t lag = first; static_cast<double>(lag) * errors.step_s() <= kFarthestCompared_s; lag += lag / 3 + 1) {
    if (const std::optional<Variance> its = errors.variance(lag); its && (its->rad2 > 0).all()) {
      variances.push_back(*its);
    }
  }
  const std::optional<ErrorModel> model = variances.empty() ? std::nullopt : model_of(variances);
  if (!model) {
    return std::nullopt;
  }
  CorrelatedFixes found;
  found.time_s = model->time_s;
  found.part = model->part.maxCoeff();
  found.apart_s = std::ceil(found.time_s * std::log(found.part / kLeft) / errors.step_s()) * errors.step_s();
  return found.apart_s > errors.step_s() ? std::optional(found) : std::nullopt;
}

}  // namespace

std::vector<CorrelatedFixes> correlated_fixes(const Pass& pass) {
  std::vector<CorrelatedFixes> all;
  const GyroReadings readings(pass);
  if (readings.gyros() < 2) {
    return all;
  }
  for (std::size_t head = 0; head <= pass.further_star_trackers.size(); ++head) {
    std::optional<CorrelatedFixes> found = correlated(pass.fixes_of(head), readings);
    if (found) {
      found->head = static_cast<int>(head);
      all.push_back(*found);
    }
  }
  return all;
}

void leave_out(std::vector<CorrelatedFixes>& correlated, Pass& pass) {
  for (CorrelatedFixes& its : correlated) {
    StarTrackerTelemetry& fixes = pass.fixes_of(static_cast<std::size_t>(its.head));
    StarTrackerTelemetry kept;
    const Duration apart = from_seconds(0.98 * its.apart_s);  // stamps are not quite regular
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      if (kept.t.empty() || std::chrono::abs(fixes.t[i] - kept.t.back()) >= apart) {
        kept.add(fixes, i);
      }
    }
    its.left_out = std::ssize(fixes.t) - std::ssize(kept.t);
    fixes = std::move(kept);
    if (its.head == 0) {
      pass.settings.star_tracker_period = from_seconds(its.apart_s);
    }
  }
}

}  // namespace trihedron::ground
