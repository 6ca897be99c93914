#include "batch/smoothed_attitude.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/ground/tasks/on_all_cores.hpp"

namespace trihedron::ground {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

/// Half-widths of the fit.
constexpr std::array<Duration, SmoothReadings::kReaches> kHalfWidths = {
    std::chrono::milliseconds(700), std::chrono::milliseconds(1400), std::chrono::milliseconds(3000)};

constexpr int kPolynomialDegree = 3;

/// Over so long to both sides of a time fixes are averaged, some tens of them.
constexpr Duration kMisfitReach = std::chrono::minutes(1);
/// Of the mean; by chance it is beyond in one of a hundred places.
constexpr double kMisfitSigmas = 2.5;
/// … and readings at the fixes, some hundreds of them.
constexpr Duration kReadingsReach = std::chrono::minutes(5);

/// Which of the times are within `reach` of t: the first, and the one after the last.
std::pair<std::size_t, std::size_t> within(const std::vector<Time>& times, Time t, Duration reach) {
  return {static_cast<std::size_t>(std::ranges::lower_bound(times, t - reach) - times.begin()),
          static_cast<std::size_t>(std::ranges::upper_bound(times, t + reach) - times.begin())};
}

Vector3d with_misfit(const Vector3d& sigma_rad, const Vector3d& square_rad2) {
  return (sigma_rad.cwiseAbs2() + square_rad2).cwiseSqrt();
}

}  // namespace

void LocalMisfit::add(Time t, const Vector3d& off_rad, const Vector3d& sigma_rad) {
  constexpr double kOutlierSigmas = 5;
  if ((off_rad.array().abs() > kOutlierSigmas * sigma_rad.array()).any()) {
    return;
  }
  const Vector3d weight = sigma_rad.cwiseAbs2().cwiseInverse();
  t_.push_back(t);
  weights_.emplace_back(weights_.back() + weight);
  weighted_.emplace_back(weighted_.back() + weight.cwiseProduct(off_rad));
}

void LocalMisfit::Readings::add(Time t, const MisfitOfReadings& misfit) {
  t_.push_back(t);
  squares_.emplace_back(squares_.back() + misfit.square_rad2);
  variances_.emplace_back(variances_.back() + misfit.sigma_rad2.square());
}

MisfitOfReadings LocalMisfit::Readings::mean(std::size_t from, std::size_t to) const {
  const auto count = static_cast<double>(to - from);
  return {(squares_[to] - squares_[from]) / count, (variances_[to] - variances_[from]).sqrt() / count};
}

// A body that shakes for hours is seen in the mean of the pass before ten minutes show it; but no more of it than these
// leave room for, where there are readings at fixes at all.
Eigen::Array3d LocalMisfit::Readings::square_rad2(Time t) const {
  if (t_.empty()) {
    return Eigen::Array3d::Zero();
  }
  const auto shown_rad2 = [](const MisfitOfReadings& its, const Eigen::Array3d& otherwise_rad2) {
    return Eigen::Array3d((its.square_rad2 > kMisfitSigmas * its.sigma_rad2).select(its.square_rad2, otherwise_rad2));
  };
  const Eigen::Array3d of_pass_rad2 = shown_rad2(mean(0, t_.size()), Eigen::Array3d::Zero());
  const auto [from, to] = within(t_, t, kReadingsReach);
  if (from == to) {
    return of_pass_rad2;
  }
  const MisfitOfReadings here = mean(from, to);
  const Eigen::Array3d room_rad2 = here.square_rad2 + kMisfitSigmas * here.sigma_rad2;
  return shown_rad2(here, of_pass_rad2.min(room_rad2).max(0.0));
}

Vector3d LocalMisfit::square_rad2(Time t, int reach) const {
  Vector3d found = Vector3d::Zero();
  if (const auto [from, to] = within(t_, t, kMisfitReach); from < to) {
    const Eigen::Array3d variance = (weights_[to] - weights_[from]).cwiseInverse();
    const Eigen::Array3d square = (variance * (weighted_[to] - weighted_[from]).array()).square();
    found += (square > kMisfitSigmas * kMisfitSigmas * variance).select(square - variance, 0.0).matrix();
  }
  if (reach != SmoothReadings::kNone) {
    found += readings_.front().square_rad2(t).matrix();
  }
  if (reach > 0) {
    found += readings_[static_cast<std::size_t>(reach)].square_rad2(t).matrix();
  }
  return found;
}

// Of two fits of which one is by a part of the samples of the other, the difference has the difference of the
// variances.
double SmoothReadings::variance_apart(const At& longer, const At& shorter) {
  return shorter.noise_factor * shorter.noise_factor - longer.noise_factor * longer.noise_factor;
}

// Where the readings bend, the longest that agrees with all that are shorter (Lepski 1991): residuals that pass for
// those of the readout may be those of a cubic that is off by several of its sigmas.
SmoothReadings::At SmoothReadings::at(Time t, const At& otherwise) const {
  const std::optional<Fit> longest = fit(t, otherwise.used, kReaches - 1);
  if (longest && !bends(*longest, t)) {
    return at(*longest);
  }
  std::vector<At> taken;
  for (int reach = 0; reach < kReaches; ++reach) {
    const std::optional<Fit> longer = fit(t, otherwise.used, reach);
    if (longer && std::ranges::all_of(taken, [&](const At& shorter) { return agree(at(*longer), shorter); })) {
      taken.push_back(at(*longer));
    }
  }
  return taken.empty() ? otherwise : taken.back();
}

bool SmoothReadings::agree(const At& longer, const At& shorter) const {
  constexpr double kSigmas = 3;
  double square = 0;
  int freedom = 0;
  for (int k = 0; k < gyros_; ++k) {
    if (longer.used[k] && shorter.used[k]) {
      const double noise_rad = setup_.readout_noise_rad[k];
      square += (longer.h_b[k] - shorter.h_b[k]).squaredNorm() / (noise_rad * noise_rad);
      freedom += 2;
    }
  }
  return square <= (freedom + kSigmas * std::sqrt(2.0 * freedom)) * variance_apart(longer, shorter);
}

std::optional<MisfitOfReadings> SmoothReadings::off_the_shortest(Time t, const At& longer,
                                                                 const AttitudeByDirections& attitude) const {
  const std::optional<Fit> shortest = longer.reach > 0 ? fit(t, longer.used, 0) : std::nullopt;
  if (!shortest) {
    return std::nullopt;
  }
  Vector3d off_rad = Vector3d::Zero();
  Eigen::Array3d variance_rad2 = Eigen::Array3d::Zero();
  for (int k = 0; k < gyros_; ++k) {
    if (shortest->used[k]) {
      const Eigen::Matrix3d by_turn = attitude.by_direction(k) * C_c_b_[k];
      off_rad += by_turn * shortest->its.h_b[k].cross(longer.h_b[k]);
      variance_rad2 += std::pow(setup_.readout_noise_rad[k], 2) * variance_apart(longer, at(*shortest)) *
                       by_turn.rowwise().squaredNorm().array();
    }
  }
  return MisfitOfReadings{off_rad.array().square() - variance_rad2, std::numbers::sqrt2 * variance_rad2};
}

std::optional<UnfollowedMotion> SmoothReadings::off_the_readings(Time t, const GyroMask& used) const {
  const std::optional<Fit> shortest = fit(t, used, 0);
  return shortest && shortest->unfollowed.sigma_rad2 > 0 ? std::optional(shortest->unfollowed) : std::nullopt;
}

std::optional<SmoothReadings::Fit> SmoothReadings::fit(Time t, const GyroMask& used, int reach) const {
  constexpr int kLeast = DirectionsFit::least_samples(kPolynomialDegree);
  const Duration half = kHalfWidths[static_cast<std::size_t>(reach)];
  const std::size_t first = samples_.from(t - half);
  const std::size_t end = samples_.from(t + half + Duration{1});
  const auto size = static_cast<int>(end - first);
  if (size < kLeast) {
    return std::nullopt;
  }
  GyroMask all_used = used;
  for (std::size_t i = first; i < end; ++i) {
    if (i > first && samples_.t(i) - samples_.t(i - 1) > setup_.max_interpolation()) {
      return std::nullopt;
    }
    all_used = both(all_used, samples_.used(i));
  }
  Fit found{{}, {}, {}, first, end - 1, reach};
  for (int k = 0; k < gyros_; ++k) {
    found.used[k] = all_used[k];
  }
  if (count(found.used) < 2) {
    return std::nullopt;
  }
  const auto [one, other] = first_two(found.used);
  const Eigen::Matrix3d C = C_c_b_[one].transpose() * C_c_b_[other];
  const auto cosine = [&, i = one, j = other](const Directions& h_b) { return h_b[i].dot(C * h_b[j]); };
  DirectionsFit fit(t, samples_.t(first), samples_.t(end - 1), size, kPolynomialDegree, gyros_);
  for (std::size_t i = first; i < end; ++i) {
    const Directions h_b = samples_.h_b(i);
    fit.add(samples_.t(i), h_b, cosine(h_b));
  }
  found.its = fit.solve();
  if (!found.its.explains(found.used, setup_.readout_noise_rad)) {
    return std::nullopt;
  }
  found.unfollowed = found.its.unfollowed(one, other, cosine(found.its.h_b), setup_.readout_noise_rad);
  return found;
}

bool SmoothReadings::bends(const Fit& fit, Time t) const {
  constexpr double kSigmas = 5;
  const double part = to_seconds(t - samples_.t(fit.first)) / to_seconds(samples_.t(fit.last) - samples_.t(fit.first));
  const Directions begin = samples_.h_b(fit.first);
  const Directions end = samples_.h_b(fit.last);
  double square = 0;
  for (int k = 0; k < gyros_; ++k) {
    if (fit.used[k]) {
      const double noise_rad = setup_.readout_noise_rad[k];
      square += (fit.its.h_b[k] - begin[k] - part * (end[k] - begin[k])).squaredNorm() / (noise_rad * noise_rad);
    }
  }
  return square > kSigmas * kSigmas;
}

std::optional<SmoothedAttitude::Rows> SmoothedAttitude::rows_at(const PassProblem::Moment& moment,
                                                                const SmoothReadings::At& otherwise) const {
  const SmoothReadings::At reading = readings_.at(moment.t, otherwise);
  const auto attitude = problem_.attitude(moment, reading.h_b, reading.used);
  if (!attitude) {
    return std::nullopt;
  }
  Rows rows{attitude.value(), problem_.attitude_by_states(moment, attitude.value(), reading.h_b), Vector3d::Zero(),
            reading};
  for (int k = 0; k < problem_.layout().gyros; ++k) {
    const double noise_rad = problem_.setup().on_board.readout_noise_rad[k] * reading.noise_factor;
    rows.readout_variance_rad2 += noise_rad * noise_rad * attitude.value().by_direction(k).rowwise().squaredNorm();
  }
  return rows;
}

SmoothedAttitude::At SmoothedAttitude::with_sigma(const Rows& rows, const Eigen::Ref<const MatrixXd>& spread) {
  const Vector3d variance_rad2 = spread.rowwise().squaredNorm();
  return {rows.attitude.C_in_c, (variance_rad2 + rows.readout_variance_rad2).cwiseSqrt(), rows.reading.reach};
}

std::optional<SmoothedAttitude::At> SmoothedAttitude::at(const PassProblem::Moment& moment,
                                                         const SmoothReadings::At& otherwise) const {
  const std::optional<Rows> rows = rows_at(moment, otherwise);
  return rows ? std::optional(with_sigma(*rows, roots_.spread(moment.arc, rows->by_states))) : std::nullopt;
}

void SmoothedAttitude::append(const At& attitude, Time t, AttitudeHistory& history) {
  history.t.push_back(t);
  history.q_in_c.push_back(attitude.C_in_c.quaternion());
  history.sigma_rad.push_back(attitude.sigma_rad);
}

SmoothedCourse SmoothedAttitude::course() const {
  SmoothedCourse course;
  const int gyros = problem_.layout().gyros;
  const CalibrationSetup& setup = problem_.setup().on_board;
  course.readings.gyros = gyros;
  std::vector<int> reaches;
  // Those of an arc together, because their sigmas are one large product.
  std::vector<Rows> of_arc;
  std::size_t arc = 0;
  const auto take_sigmas = [&] {
    const auto count = static_cast<Eigen::Index>(of_arc.size());
    MatrixXd all(3 * count, problem_.layout().size());
    for (Eigen::Index i = 0; i < count; ++i) {
      all.middleRows<3>(3 * i) = of_arc[static_cast<std::size_t>(i)].by_states;
    }
    const MatrixXd spread = roots_.spread(arc, all);
    for (Eigen::Index i = 0; i < count; ++i) {
      const At its = with_sigma(of_arc[static_cast<std::size_t>(i)], spread.middleRows<3>(3 * i));
      course.attitude.sigma_rad.push_back(its.sigma_rad);
    }
    of_arc.clear();
  };
  problem_.go_along(solution_, [&](const PassProblem::Moment& moment) {
    if (moment.fix == nullptr) {
      return;
    }
    std::optional<Rows> rows = rows_at(moment, {moment.fix->h_b, moment.fix->used, moment.fix->noise_factor});
    if (!rows) {
      return;
    }
    if (const auto misfit = readings_.off_the_readings(moment.t, rows->reading.used)) {
      course.misfit.add_readings(moment.t, 0, MisfitOfReadings::about_all_axes(*misfit));
    }
    if (const auto misfit = readings_.off_the_shortest(moment.t, rows->reading, rows->attitude)) {
      course.misfit.add_readings(moment.t, rows->reading.reach, *misfit);
    }
    reaches.push_back(rows->reading.reach);
    if (moment.arc != arc) {
      take_sigmas();
      arc = moment.arc;
    }
    if (moment.fix->fix.head == 0) {
      const FixBySharedStates by_shared = fix_by_shared_states(setup, moment.fix->fix, moment.fix->rate_c);
      const Rot<In, C> fix = corrected(moment.fix->fix, by_shared.lazyProduct(solution_.shared));
      course.misfit.add(moment.t, (rows->attitude.C_in_c.inverse() * fix).log().raw(),
                        fix_noise(setup, moment.fix->fix).diagonal().cwiseSqrt());
    }
    course.attitude.t.push_back(moment.t);
    course.attitude.q_in_c.push_back(rows->attitude.C_in_c.quaternion());
    course.readings.t.push_back(moment.t);
    for (int k = 0; k < gyros; ++k) {
      const Vector3d h_b =
          moment.gyros[k].C_c_b.transpose() * (rows->attitude.C_in_c.raw().transpose() * moment.gyros[k].h_in);
      course.readings.h.insert(course.readings.h.end(), h_b.begin(), h_b.end());
    }
    of_arc.push_back(*std::move(rows));
  });
  take_sigmas();
  for (std::size_t i = 0; i < course.attitude.t.size(); ++i) {
    Vector3d& sigma_rad = course.attitude.sigma_rad[i];
    sigma_rad = with_misfit(sigma_rad, course.misfit.square_rad2(course.attitude.t[i], reaches[i]));
  }
  return course;
}

AttitudeHistory SmoothedAttitude::between(const PassProblem::Moment& from, const PassProblem::Moment& to,
                                          const LocalMisfit& misfit) const {
  AttitudeHistory history;
  PassProblem::Moment moment = to;
  const ScreenedSamples& samples = screened_.samples;
  for (std::size_t i = samples.from(from.t + Duration{1}); i < samples.size() && samples.t(i) <= to.t; ++i) {
    moment.t = samples.t(i);
    // From node to node a momentum turns evenly, by arcseconds at most.
    const double part = to_seconds(moment.t - from.t) / to_seconds(to.t - from.t);
    for (int k = 0; k < screened_.gyros; ++k) {
      moment.gyros[k].h_in = (from.gyros[k].h_in + part * (to.gyros[k].h_in - from.gyros[k].h_in)).normalized();
    }
    if (auto attitude = at(moment, {samples.h_b(i), samples.used(i)})) {
      attitude->sigma_rad = with_misfit(attitude->sigma_rad, misfit.square_rad2(moment.t, attitude->reach));
      append(*attitude, moment.t, history);
    }
  }
  return history;
}

AttitudeHistory SmoothedAttitude::definitive(const LocalMisfit& misfit) const {
  constexpr std::size_t kNodesAtOnce = 1000;  // a node takes some kilobytes
  AttitudeHistory whole;
  std::vector<PassProblem::Moment> nodes;
  const auto take = [&] {
    const auto parts =
        on_all_cores(nodes.size() - 1, [&](std::size_t i) { return between(nodes[i], nodes[i + 1], misfit); });
    for (const AttitudeHistory& part : parts) {
      whole.t.insert(whole.t.end(), part.t.begin(), part.t.end());
      whole.q_in_c.insert(whole.q_in_c.end(), part.q_in_c.begin(), part.q_in_c.end());
      whole.sigma_rad.insert(whole.sigma_rad.end(), part.sigma_rad.begin(), part.sigma_rad.end());
    }
    nodes.erase(nodes.begin(), std::prev(nodes.end()));
  };
  problem_.go_along(solution_, [&](const PassProblem::Moment& moment) {
    if (nodes.empty()) {  // a sample at the first node counts as after it
      nodes.push_back(moment);
      nodes.back().t -= Duration{1};
    }
    nodes.push_back(moment);
    if (nodes.size() > kNodesAtOnce) {
      take();
    }
  });
  take();
  return whole;
}

}  // namespace trihedron::ground
