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

#include "calibrate/at_rest.hpp"
#include "clocks/turns.hpp"
#include "model/scatter.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/core/optimal_attitude.hpp"

namespace trihedron::ground {
namespace {

/// Rotation, c axes, of the trihedron of two momenta by rotations of their readings, rad.
using ByAlignments = Eigen::Matrix<double, 3, 6, Eigen::RowMajor>;
ByAlignments by_alignments(const Eigen::Matrix3d& C_c_g, double cosine) {
  const Eigen::Vector3d across = C_c_g.col(0);
  const Eigen::Vector3d first = C_c_g.col(1);  // momentum
  const Eigen::Vector3d beside = C_c_g.col(2);
  const double cotangent = cosine / std::sqrt(1 - cosine * cosine);
  ByAlignments in_g = ByAlignments::Zero();
  in_g.block<1, 3>(0, 0) = across.transpose();
  in_g.block<1, 3>(1, 0) = cotangent * beside.transpose();
  in_g.block<1, 3>(1, 3) = (first - cotangent * beside).transpose();
  in_g.block<1, 3>(2, 0) = beside.transpose();
  return C_c_g * in_g;
}

/// A fix beside the trihedron g of the first two momenta.
struct FixByGyros {
  Eigen::Matrix3d C_in_c;  ///< by the fix
  Eigen::Matrix3d C_c_g;   ///< by the readings
  ByAlignments by_alignments;
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
    constexpr std::size_t kMostFixes = 100'000;  // days, at the usual rate
    const GyroMask all = all_gyros(readings.gyros());
    std::size_t from = 0;
    for (std::size_t i = 0; i < std::min(fixes.size(), kMostFixes); ++i) {
      const std::optional<FittedDirections> fitted = readings.at(fixes.t[i], from);
      if (fitted && nearly_unit(fixes.q_in_c[i].norm())) {
        const Eigen::Matrix3d C_c_g = triad(fitted->h_b[0], fitted->h_b[1]);
        fixes_.push_back({fixes.q_in_c[i].normalized().toRotationMatrix(), C_c_g,
                          by_alignments(C_c_g, fitted->h_b[0].dot(fitted->h_b[1]))});
        at_rest_.add(to_seconds(fixes.t[i] - fixes.t.front()), rate_by_directions(fitted->h_b, fitted->h_b_rate, all));
      }
    }
    at_rest_.settle();
  }

  /// Between fixes; 0 where there are too few.
  [[nodiscard]] double step_s() const { return at_rest_.step_s(); }
  [[nodiscard]] double farthest_s() const { return at_rest_.farthest_s(); }

  /// Of the errors of fixes so many steps apart: as far as these errors are alike it is less than theirs. Nothing where
  /// there are too few.
  [[nodiscard]] std::optional<Variance> variance(std::size_t lag) const {
    std::vector<double> differences_rad;  // three each
    std::vector<double> by_alignments;    // 3 × 6 each, row by row
    at_rest_.for_each_five(lag, [&](const AtRest::Five& five) {
      const std::array<Eigen::Array3d, 5> off_rad = off_from_first(five);
      if (AtRest::may_be_alignment(off_rad.back().matrix().norm(), turned_rad(five))) {
        const Eigen::Array3d difference = AtRest::fourth_difference(off_rad);
        const ByAlignments rows = AtRest::fourth_difference(by_alignments_from_first(five));
        differences_rad.insert(differences_rad.end(), difference.begin(), difference.end());
        by_alignments.insert(by_alignments.end(), rows.data(), rows.data() + rows.size());
      }
    });
    const std::size_t count = differences_rad.size() / 3;
    if (count < AtRest::kFewest) {
      return std::nullopt;
    }
    const auto size = static_cast<Eigen::Index>(differences_rad.size());
    const Eigen::Array3d sigma_rad = sigmas_less_alignments(
        Eigen::VectorXd::Map(differences_rad.data(), size),
        Eigen::Matrix<double, 6, Eigen::Dynamic>::Map(by_alignments.data(), 6, size).transpose(), 3);
    return Variance{static_cast<double>(lag) * step_s(), sigma_rad.square() / AtRest::kSquares, count};
  }

 private:
  /// The rotations, c axes, from the attitude by the readings to that by each fix, both from the first fix on.
  [[nodiscard]] std::array<Eigen::Array3d, 5> off_from_first(const AtRest::Five& five) const {
    const FixByGyros& first = fixes_[five.front()];
    const Eigen::Matrix3d C_g_in = (first.C_in_c * first.C_c_g).transpose();
    std::array<Eigen::Array3d, 5> off_rad;
    std::ranges::transform(five, off_rad.begin(), [&](std::size_t i) {
      const Eigen::Matrix3d off = fixes_[i].C_c_g * C_g_in * fixes_[i].C_in_c;
      return Eigen::Array3d(0.5 * (off(2, 1) - off(1, 2)), 0.5 * (off(0, 2) - off(2, 0)),
                            0.5 * (off(1, 0) - off(0, 1)));
    });
    return off_rad;
  }

  /// How alignments change these rotations.
  [[nodiscard]] std::array<ByAlignments, 5> by_alignments_from_first(const AtRest::Five& five) const {
    const FixByGyros& first = fixes_[five.front()];
    std::array<ByAlignments, 5> rows;
    std::ranges::transform(five, rows.begin(), [&](std::size_t i) {
      // By the readings: with the errors of the fixes in it, alignments would turn these about.
      const Eigen::Matrix3d turn = fixes_[i].C_c_g * first.C_c_g.transpose();
      return ByAlignments(fixes_[i].by_alignments - turn * first.by_alignments);
    });
    return rows;
  }

  [[nodiscard]] double turned_rad(const AtRest::Five& five) const {
    return (fixes_[five.back()].C_c_g - fixes_[five.front()].C_c_g).norm() / std::numbers::sqrt2;
  }

  std::vector<FixByGyros> fixes_;
  AtRest at_rest_;
};

/// How much less than theirs the variance by fourth differences is of errors with the correlation exp(−lag / τ).
double alike(double lag_over_time) {
  const double r = std::exp(-lag_over_time);
  return (112 * r - 56 * r * r + 16 * std::pow(r, 3) - 2 * std::pow(r, 4)) / AtRest::kSquares;
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
    Eigen::ArrayX2d parts(size, 2);
    Eigen::ArrayXd weights(size);
    for (Eigen::Index i = 0; i < size; ++i) {
      const Variance& its = variances[static_cast<std::size_t>(i)];
      weights(i) = std::sqrt(static_cast<double>(its.differences));
      parts.row(i) << 1, -alike(its.lag_s / time_s);
      parts.row(i) *= weights(i) / its.rad2(axis);
    }
    const Eigen::Vector2d found = parts.matrix().colPivHouseholderQr().solve(weights.matrix());
    model.part(axis) = std::clamp(found(1) / found(0), 0.0, 1.0);
    const Eigen::ArrayXd shape = parts.col(0) + model.part(axis) * parts.col(1);
    const double variance_rad2 = (shape * weights).sum() / shape.square().sum();
    model.misfit += (variance_rad2 * shape - weights).square().sum();
  }
  return model;
}

/// The most likely τ; nothing where it may as well be kLongest_s or more.
std::optional<ErrorModel> model_of(const std::vector<Variance>& variances) {
  constexpr double kLongest_s = 120;
  constexpr double kStep = 1.05;
  constexpr double kSure = 3;  // sigmas
  ErrorModel best;
  const double shortest_s = variances.front().lag_s / 4;
  const int steps = static_cast<int>(std::log(kLongest_s / shortest_s) / std::log(kStep));
  for (int i = 0; i < steps; ++i) {
    const ErrorModel model = model_with(shortest_s * std::pow(kStep, i), variances);
    best = model.misfit < best.misfit ? model : best;
  }
  const double more = model_with(kLongest_s, variances).misfit - best.misfit;
  return more > std::pow(kSure * AtRest::kChanceOfOne, 2) ? std::optional(best) : std::nullopt;
}

/// Whether errors of fixes `near` each other differ less than those of fixes further apart, about one axis or all three
/// together, by more than chance makes of it.
bool are_correlated(const Variance& near, const Variance& far) {
  constexpr double kMore = 1.05;    // times the variance
  constexpr double kSure = 5;       // sigmas
  constexpr double kLeast = 1e-14;  // rad², a fiftieth of an arcsecond
  const double chance = AtRest::kChanceOfOne *
                        std::sqrt(1 / static_cast<double>(near.differences) + 1 / static_cast<double>(far.differences));
  const Eigen::Array3d ratio = far.rad2 / near.rad2.max(kLeast);
  return ratio.maxCoeff() > kMore + kSure * chance || ratio.mean() > kMore + kSure * chance / std::numbers::sqrt3;
}

std::optional<CorrelatedFixes> correlated(const StarTrackerTelemetry& fixes, const GyroReadings& readings) {
  // Of what is left of the correlation the variance of a mean is so much more.
  constexpr double kMoreOfMean = 0.1;
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
  for (std::size_t lag = first; static_cast<double>(lag) * errors.step_s() <= errors.farthest_s(); lag += lag / 3 + 1) {
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
  found.step_s = errors.step_s();
  const double apart_s = found.time_s * std::log(1 + 2 * found.part / kMoreOfMean);
  found.apart_s = std::ceil(apart_s / found.step_s) * found.step_s;
  return found.apart_s > found.step_s ? std::optional(found) : std::nullopt;
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
    const Duration apart = from_seconds(its.apart_s - its.step_s / 4);  // stamps are not quite regular
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      const bool is_first = kept.t.empty() || std::chrono::abs(fixes.t[i] - kept.t.back()) >= apart;
      if (is_first && nearly_unit(fixes.q_in_c[i].norm())) {
        kept.add(fixes, i);
      }
    }
    its.left_out = std::ssize(fixes.t) - std::ssize(kept.t);
    fixes = std::move(kept);
  }
}

std::optional<Pass> without(std::vector<CorrelatedFixes>& correlated, const Pass& pass) {
  if (correlated.empty()) {
    return std::nullopt;
  }
  Pass rest = pass;
  leave_out(correlated, rest);
  return rest;
}

}  // namespace trihedron::ground
