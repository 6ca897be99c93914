#include "calibrate/correlated_fixes.hpp"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include "clocks/turns.hpp"
#include "model/scatter.hpp"
#include "model/slews.hpp"
#include "trihedron/core/frames.hpp"

namespace trihedron::ground {
namespace {

/// Fixes further apart are not compared: over four times as long what the alignments are off turns with the body.
constexpr double kFarthestCompared_s = 240;
/// Fourth differences from which a variance is told, and those that are enough.
constexpr std::size_t kFewestFourths = 500;
constexpr std::size_t kEnoughFourths = 10000;

/// A fix beside the trihedron g of the first two momenta.
struct FixByGyros {
  double t_s;
  Eigen::Matrix3d C_in_c;  ///< by the fix
  Eigen::Matrix3d C_c_g;   ///< by the readings
};

/// rad² about c x, y, z, from so many differences.
struct Variance {
  Eigen::Array3d rad2;
  std::size_t differences;
};

/// Errors of fixes against the gyros, while the body is at rest.
class ErrorsAtRest {
 public:
  ErrorsAtRest(const StarTrackerTelemetry& fixes, const GyroReadings& readings) {
    std::vector<double> turning_rad_s;
    std::size_t from = 0;
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      const std::optional<FittedDirections> fitted = readings.at(fixes.t[i], from);
      if (fitted && nearly_unit(fixes.q_in_c[i].norm())) {
        compared_.push_back({to_seconds(fixes.t[i] - fixes.t.front()), fixes.q_in_c[i].normalized().toRotationMatrix(),
                             triad(fitted->h_b[0], fitted->h_b[1])});
        turning_rad_s.push_back(std::max(fitted->h_b_rate[0].norm(), fitted->h_b_rate[1].norm()));
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
    std::vector<double> sorted = turning_rad_s;
    const double usual_rad_s = median_of(sorted);
    for (const double rate : turning_rad_s) {
      const bool rests = is_at_rest(rate, usual_rad_s) || rate < kSlowestSlew_rad_s;
      in_motion_.push_back((in_motion_.empty() ? 0 : in_motion_.back()) + (rests ? 0 : 1));
    }
  }

  /// Between fixes; 0 where there are too few.
  [[nodiscard]] double step_s() const { return step_s_; }

  /// Of the errors of fixes so many steps apart, by their fourth differences: as far as these errors are alike it is
  /// less than theirs. Nothing where there are too few.
  [[nodiscard]] std::optional<Variance> variance(std::size_t lag) const {
    const std::size_t span = 4 * lag;
    if (compared_.size() <= span) {
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
    Variance found{{}, sizes[0].size()};
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

/// By the variances, rad², one column for each of the lags, about the axes about which errors are `correlated`: least
/// squares of relative differences.
ErrorModel model_with(double time_s, const Eigen::VectorXd& lags_s, const Eigen::Array3Xd& variances_rad2,
                      const Eigen::Array<bool, 3, 1>& correlated) {
  ErrorModel model{time_s, Eigen::Array3d::Zero(), 0};
  Eigen::MatrixX2d parts(lags_s.size(), 2);
  parts.col(0).setOnes();
  parts.col(1) = -lags_s.unaryExpr([time_s](double lag_s) { return alike(lag_s / time_s); });
  for (int axis = 0; axis < 3; ++axis) {
    if (correlated(axis)) {
      const Eigen::MatrixX2d relative = parts.array().colwise() / variances_rad2.row(axis).transpose();
      const Eigen::VectorXd ones = Eigen::VectorXd::Ones(lags_s.size());
      const Eigen::Vector2d found = relative.colPivHouseholderQr().solve(ones);
      model.part(axis) = std::clamp(found(1) / found(0), 0.0, 1.0);
      model.misfit += (relative * found - ones).squaredNorm();
    }
  }
  return model;
}

/// The most likely τ up to kLongest_s; nothing where it is no less than that.
std::optional<ErrorModel> model_of(const Eigen::VectorXd& lags_s, const Eigen::Array3Xd& variances_rad2,
                                   const Eigen::Array<bool, 3, 1>& correlated) {
  constexpr double kLongest_s = 120;
  constexpr double kStep = 1.05;
  ErrorModel best;
  for (double time_s = lags_s(0) / 4; time_s <= kLongest_s; time_s *= kStep) {
    const ErrorModel model = model_with(time_s, lags_s, variances_rad2, correlated);
    best = model.misfit < best.misfit ? model : best;
  }
  return best.time_s * kStep * kStep < kLongest_s ? std::optional(best) : std::nullopt;
}

/// Axes about which the errors of fixes `near` differ less than those of fixes eight times as far apart, by more than
/// chance makes of it.
Eigen::Array<bool, 3, 1> correlated_axes(const Variance& near, const Variance& far) {
  constexpr double kMore = 1.25;   // times the variance
  constexpr double kSure = 5;      // sigmas
  constexpr double kChance = 2.3;  // 1-sigma of a variance by one difference, for those that overlap
  const double chance =
      kChance * std::sqrt(1 / static_cast<double>(near.differences) + 1 / static_cast<double>(far.differences));
  return far.rad2 > (kMore + kSure * chance) * near.rad2;
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
  const std::optional<Variance> far = errors.variance(8 * first);
  if (!near || !far || !correlated_axes(*near, *far).any()) {
    return std::nullopt;
  }
  std::vector<double> lags_s;
  std::vector<double> variances_rad2;
  for (std::size_t lag = first; static_cast<double>(lag) * errors.step_s() <= kFarthestCompared_s; lag += lag / 3 + 1) {
    if (const std::optional<Variance> its = errors.variance(lag)) {
      lags_s.push_back(static_cast<double>(lag) * errors.step_s());
      variances_rad2.insert(variances_rad2.end(), its->rad2.begin(), its->rad2.end());
    }
  }
  const auto count = std::ssize(lags_s);
  const std::optional<ErrorModel> model =
      model_of(Eigen::VectorXd::Map(lags_s.data(), count), Eigen::Array3Xd::Map(variances_rad2.data(), 3, count),
               correlated_axes(*near, *far));
  if (!model) {
    return std::nullopt;
  }
  CorrelatedFixes found;
  found.time_s = model->time_s;
  found.part = model->part.maxCoeff();
  const double steps = found.time_s * std::log(found.part / kLeft) / errors.step_s();
  found.apart_s = std::max(std::ceil(steps), 1.0) * errors.step_s();
  return found;
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
      if (kept.t.empty() || fixes.t[i] - kept.t.back() >= apart) {
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
