#include "pack.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <utility>

#include "kernels.hpp"
#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/jitter.hpp"
#include "trihedron/core/outlier_gate.hpp"
#include "trihedron/core/readings.hpp"
#include "trihedron/ground/choose/settled.hpp"
#include "trihedron/ground/onboard/pipeline.hpp"
#include "trihedron/records/stop.hpp"
#include "trihedron/sim/simulate.hpp"

namespace trihedron::lanes {
namespace {

std::unique_ptr<Lane::Estimator> estimator_of(const FilterFlight& flight) {
  const PassSettings settings = sim::settings_of(flight.scenario);
  return ground::pair_estimator(settings, ground::settled_as_told(flight.options));
}

/// Not through the whole vector, as to[lane] would be.
void put(double from, std::size_t lane, V& to) { reinterpret_cast<double*>(&to)[lane] = from; }

void put(const Eigen::Vector3d& from, std::size_t lane, V3& to) {
  put(from.x(), lane, to.x);
  put(from.y(), lane, to.y);
  put(from.z(), lane, to.z);
}

void put(const Eigen::Matrix3d& from, std::size_t lane, M3& to) {
  for (int j = 0; j < 3; ++j) {
    put(from.col(j), lane, to.column[j]);
  }
}

Eigen::Vector3d vector_of(const V3& from, std::size_t lane) { return {from.x[lane], from.y[lane], from.z[lane]}; }

Eigen::Matrix3d matrix_of(const M3& from, std::size_t lane) {
  Eigen::Matrix3d m;
  for (int j = 0; j < 3; ++j) {
    m.col(j) = vector_of(from.column[j], lane);
  }
  return m;
}

/// The polynomial through the samples of these times since the fix, as DirectionsFit has it.
class FitOfTimes {
 public:
  /// Samples `first` to `last`, counted from that of the fix.
  FitOfTimes(int first, int last, double period_s) {
    const int count = last - first + 1;
    if (count < DirectionsFit::least_samples(kTerms - 1)) {
      return;
    }
    fit_.count = count;
    fit_.terms = std::clamp((count + 2) / 3, 1, kTerms);
    fit_.reach_s = std::max(std::abs(first), std::abs(last)) * period_s;
    Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
    normal.diagonal().tail(kTerms - fit_.terms).setOnes();
    for (int i = first; i <= last; ++i) {
      const double x = i * period_s / fit_.reach_s;
      std::array<double, kTerms>& powers = powers_.emplace_back();
      double power = 1;
      for (int term = 0; term < fit_.terms; ++term) {
        powers[static_cast<std::size_t>(term)] = power;
        power *= x;
      }
      const Eigen::Map<const Eigen::Vector4d> its(powers.data());
      normal += its * its.transpose();
    }
    const Eigen::Matrix<double, kTerms, kTerms> L = normal.llt().matrixL();
    Eigen::Map<Eigen::Matrix<double, kTerms, kTerms, Eigen::RowMajor>>(&fit_.L[0][0]) = L;
    const Eigen::Vector4d at_zero = L.triangularView<Eigen::Lower>().solve(Eigen::Vector4d::UnitX());
    fit_.noise_factor = at_zero.norm();
  }

  /// Through these samples.
  [[nodiscard]] Fit through(const V3 (*samples)[kGyros]) const {
    Fit fit = fit_;
    fit.samples = samples;
    fit.powers = reinterpret_cast<const double(*)[kTerms]>(powers_.data());
    return fit;
  }

 private:
  Fit fit_;
  std::vector<std::array<double, kTerms>> powers_;
};

/// The readings of a sample.
struct Kept {
  V3 h_b[kGyros];
};

/// The true attitude and momenta of all lanes, and what the gyros read of them.
class Simulation {
 public:
  Simulation(std::span<Lane* const> lanes, const Kernels& kernels);

  /// The readings of the next sample.
  void next(V3 (&h_b)[kGyros]);
  /// At the sample that next() gave last.
  [[nodiscard]] const M3& C_in_c() const { return end_; }

 private:
  [[nodiscard]] Lane& lane(std::size_t i) const { return *lanes_[std::min(i, lanes_.size() - 1)]; }
  void put_reference();
  void put_jitter();
  void put_gyros();
  void turn_begins(std::size_t i, const sim::SlewPlan::Turn& turn);
  void look_for_turns(double t_s);
  void attitude_at(double t_s, M3& C_in_c);
  void make_noise();

  static constexpr std::size_t kNoiseTogether = 32;  ///< samples

  std::span<Lane* const> lanes_;
  const Kernels& kernels_;
  Duration period_;
  Duration since_{};
  bool has_begun_ = false;
  std::vector<SplineNode> nodes_;
  std::vector<V3> jitter_;
  Attitude attitude_{};
  TrueGyro gyros_[kGyros]{};
  M3 end_{};
  std::array<std::vector<InCircle>, kGyros> points_;
  std::array<std::vector<V3>, kGyros> noise_;
  std::size_t noise_used_ = kNoiseTogether;
  std::array<std::size_t, kWidth> turns_begun_{};
  double next_turn_s_ = -std::numeric_limits<double>::infinity();
};

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

/// The readings of samples, counted from that of a fix.
struct SamplesAround {
  const Kept* of_fix;
  int first;
  int last;
  Duration period;

  [[nodiscard]] const V3* at(int sample) const { return of_fix[sample].h_b; }
};

/// The filters of all lanes.
class Filters {
 public:
  Filters(std::span<Lane* const> lanes, const Kernels& kernels);

  void predict(const V3 (&h_b)[kGyros], double dt_s);
  /// The fixes of a time, with the readings around it.
  void fix(Time t, const Fit& fit, const SamplesAround& samples, const M3& truth);
  /// What has to be flown alone since the pass ends so.
  void end(Time t);
  [[nodiscard]] bool have_all_left() const;

  [[nodiscard]] std::optional<FilterResult> result(std::size_t i) const;

 private:
  /// A flight on its way.
  struct State {
    bool has_left = false;  ///< it is to be flown alone
    bool has_started = false;
    std::size_t next_fix = 0;
    Time used_t{};
    OutlierGate gate;
    Jitter jitter;
    FilterResult result;
  };

  [[nodiscard]] static bool take_fix(const Lane& lane, State& its, Time t, StarFix& fix);
  [[nodiscard]] bool uses_both_readings(std::size_t i, Time t, const SamplesAround& samples) const;
  void start(std::size_t i, const StarFix& fix, const Fix& all);
  void load(std::size_t i, const Fix& all);
  void leave_by_time_or_geometry(std::size_t i, Time t);
  void judge(std::size_t i, Time t, Fix& fix);
  void leave_by_drift();

  std::span<Lane* const> lanes_;
  const Kernels& kernels_;
  Duration reach_;
  std::unique_ptr<Filter> filter_ = std::make_unique<Filter>();
  std::unique_ptr<Filter> before_ = std::make_unique<Filter>();
  std::unique_ptr<Fix> fix_ = std::make_unique<Fix>();
  Errors errors_{};
  std::array<State, kWidth> states_;
};

Filters::Filters(std::span<Lane* const> lanes, const Kernels& kernels)
    : lanes_(lanes), kernels_(kernels), reach_(lanes.front()->estimator->setup().reach()) {
  for (std::size_t i = 0; i < kWidth; ++i) {
    const Lane::Estimator& estimator = *lanes_[std::min(i, lanes_.size() - 1)]->estimator;
    const CalibrationSetup& setup = estimator.setup();
    for (int state = 0; state < kStates; ++state) {
      filter_->root[state * (kColumns + 1)][i] = 1;
    }
    put(setup.star_trackers[0].noise_rad.cwiseAbs2(), i, filter_->fix_variance_rad2);
    filter_->direction_random_walk_rad_sqrt_s[i] = setup.direction_random_walk_rad_sqrt_s;
    for (int k = 0; k < kGyros; ++k) {
      filter_->readout_noise_rad[k][i] = setup.readout_noise_rad[k];
      put(Eigen::Vector3d::Unit(k), i, filter_->gyro[k].h_in);
      put(estimator.prior_gyros()[k].C_c_b, i, filter_->gyro[k].C_c_b);
      for (int j = 0; j < 3; ++j) {
        put(Eigen::Vector3d::Unit(j), i, filter_->since_fix[k].by_start[j]);
      }
    }
  }
}

void Filters::predict(const V3 (&h_b)[kGyros], double dt_s) {
  kernels_.predict(*filter_, h_b, dt_s);
  for (State& its : states_) {
    its.gate.elapse(dt_s);
  }
}

/// That of the lane at this time; false where there is none.
bool Filters::take_fix(const Lane& lane, State& its, Time t, StarFix& fix) {
  const StarTrackerTelemetry& fixes = lane.fixes;
  if (its.has_left || its.next_fix >= fixes.t.size() || fixes.t[its.next_fix] != t) {
    return false;
  }
  fix.t = t;
  fix.q_in_c = fixes.q_in_c[its.next_fix++];
  return true;
}

/// Where no polynomial explains the samples around a fix: whether the reading of neither gyro is left out as a spike.
bool Filters::uses_both_readings(std::size_t i, Time t, const SamplesAround& samples) const {
  const Lane::Estimator& estimator = *lanes_[i]->estimator;
  Lane::Estimator::Gyros gyros = estimator.prior_gyros();
  Readings<kGyros> readings(estimator.setup(), true);
  for (int k = 0; k < kGyros; ++k) {
    gyros[k].h_in = vector_of(filter_->gyro[k].h_in, i);
    gyros[k].C_c_b = matrix_of(filter_->gyro[k].C_c_b, i);
  }
  for (int sample = samples.first; sample <= samples.last; ++sample) {
    GyroSample its;
    its.t = t + sample * samples.period;
    for (int k = 0; k < kGyros; ++k) {
      its.h_b[k] = vector_of(samples.at(sample)[k], i);
    }
    readings.push(its);
  }
  const GyroHealth<kGyros> health(kGyros);
  const auto at = readings.at(t, estimator.setup(), health, gyros);
  return at && at->used[0] && at->used[1];
}

/// The first fix of a lane, by its own estimator.
void Filters::start(std::size_t i, const StarFix& fix, const Fix& all) {
  State& its = states_[i];
  FixReadings readings;
  for (int k = 0; k < kGyros; ++k) {
    readings.h_b[k] = vector_of(all.readings.h_b[k], i);
    readings.used[k] = true;
  }
  readings.noise_factor = all.readings.noise_factor[i];
  readings.jitter_rad2 = static_cast<float>(all.jitter_rad2[i]);
  readings.rate_c = vector_of(all.readings.rate_c, i);
  its.has_started = lanes_[i]->estimator->correct(fix, readings).status == FixStatus::kStarted;
  its.has_left = !its.has_started;
  its.used_t = fix.t;
  if (its.has_started) {
    load(i, all);
  }
}

void Filters::load(std::size_t i, const Fix& all) {
  const Lane::Estimator& estimator = *lanes_[i]->estimator;
  const ConstRowsView root = estimator.information().root();
  for (int row = 0; row < kStates; ++row) {
    for (int column = 0; column < kStates; ++column) {
      filter_->root[row * kColumns + column][i] = root(row, column);
    }
  }
  filter_->time_since_fix_s[i] = 0;
  for (int k = 0; k < kGyros; ++k) {
    const auto& gyro = estimator.gyros()[k];
    put(gyro.h_in, i, filter_->gyro[k].h_in);
    put(gyro.C_c_b, i, filter_->gyro[k].C_c_b);
    for (int c = 0; c < kCoefficients; ++c) {
      filter_->gyro[k].kappa_rad_s[c][i] = gyro.drift_rad_s(c);
      put(Eigen::Vector3d::Zero(), i, filter_->since_fix[k].by_drift[c]);
    }
    for (int j = 0; j < 3; ++j) {
      put(Eigen::Vector3d::Unit(j), i, filter_->since_fix[k].by_start[j]);
      put(Eigen::Vector3d::Zero(), i, filter_->since_fix[k].by_alignment[j]);
    }
    const Eigen::Vector3d h_b = vector_of(all.readings.h_b[k], i);
    put(h_b, i, filter_->h_b[k]);
    put(Eigen::Vector3d(h_b.cast<float>().cast<double>()), i, filter_->h_b_at_fix[k]);
  }
}

/// In an outage of the star tracker the angles between the momenta would be used; momenta that come near to one line
/// give no attitude.
void Filters::leave_by_time_or_geometry(std::size_t i, Time t) {
  constexpr double kLeastSine = 2 * kMinSine;
  State& its = states_[i];
  const Duration longest = lanes_[i]->estimator->setup().angles_after;
  const bool is_late = its.has_started && longest != CalibrationSetup::kNever && t - its.used_t >= longest;
  its.has_left = its.has_left || is_late || !(fix_->readings.sine_square[i] > kLeastSine * kLeastSine);
}

/// Whether the gate takes the fix of a lane. It leaves where more than that happens: after so many rejections it would
/// matter that the gate is not told whether the gyros contradict each other. Nor is a fix that is far off compared
/// exactly.
void Filters::judge(std::size_t i, Time t, Fix& fix) {
  constexpr double kFarthest_rad = 0.1;
  State& its = states_[i];
  const CalibrationSetup& setup = lanes_[i]->estimator->setup();
  const double nis = fix.nis[i];
  const FixStatus status = its.gate.judge(setup, nis, fix.misfit_rad[i]);
  const bool is_used = status == FixStatus::kUsed;
  const bool is_rejected =
      status == FixStatus::kRejectedByGate && its.gate.rejections_in_a_row() + 1 < setup.reopen_after_rejections;
  its.has_left = !(is_used || is_rejected) || !std::isfinite(nis) || !(fix.apart_rad[i] < kFarthest_rad);
  fix.is_used[i] = is_used ? 1 : 0;
  ++its.result.fixes_judged;
  its.result.nis_sum_of_judged += nis;
  if (is_used) {
    ++its.result.fixes_used;
    its.result.nis_sum += nis;
    its.used_t = t;
  }
}

void Filters::fix(Time t, const Fit& fit, const SamplesAround& samples, const M3& truth) {
  Fix& all = *fix_;
  kernels_.fit(*filter_, fit, samples.of_fix->h_b, all.readings);
  V is_corrected{};
  V counts{};
  bool corrects_all = lanes_.size() == kWidth;
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    State& its = states_[i];
    leave_by_time_or_geometry(i, t);
    StarFix fix;
    const bool has_fix = take_fix(*lanes_[i], its, t, fix);
    if (has_fix && !(all.readings.is_explained[i] > 0) && !uses_both_readings(i, t, samples)) {
      its.has_left = true;
      continue;
    }
    put(fix.q_in_c.normalized().toRotationMatrix(), i, all.C_in_c);
    if (has_fix) {
      const FittedReadings& readings = all.readings;
      its.jitter.add(t, reach_, {readings.unfollowed_square_rad2[i], readings.unfollowed_sigma_rad2[i]});
      all.jitter_rad2[i] = readings.noise_factor[i] < 1 ? static_cast<double>(its.jitter.square_rad2()) : 0;
      is_corrected[i] = its.has_started ? 1 : 0;
      if (!its.has_started) {
        start(i, fix, all);
      }
      counts[i] = its.has_started ? 1 : 0;
    }
    corrects_all = corrects_all && is_corrected[i] > 0;
  }
  if (!corrects_all) {
    *before_ = *filter_;
  }
  all.is_used = V{};
  kernels_.begin_fix(*filter_, all);
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    if (is_corrected[i] > 0) {
      judge(i, t, all);
    }
  }
  kernels_.finish_fix(*filter_, all);
  kernels_.add_error(all, truth, counts, errors_);
  if (!corrects_all) {
    kernels_.blend(*filter_, *before_, is_corrected);
  }
  leave_by_drift();
}

/// Where the estimates turn a momentum by more than is exact.
void Filters::leave_by_drift() {
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    for (const Gyro& gyro : filter_->gyro) {
      double most_rad_s = 0;
      for (const V& kappa : gyro.kappa_rad_s) {
        most_rad_s += std::abs(kappa[i]);
      }
      const double most_rad = most_rad_s * to_seconds(lanes_[i]->scenario->gyro_period);
      states_[i].has_left = states_[i].has_left || !(most_rad < kLittle_rad);
    }
  }
}

/// Angles would be used as well if they are due before the last samples.
void Filters::end(Time t) {
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    leave_by_time_or_geometry(i, t - 3 * reach_);
  }
}

bool Filters::have_all_left() const {
  return std::all_of(states_.begin(), states_.begin() + static_cast<std::ptrdiff_t>(lanes_.size()),
                     [](const State& its) { return its.has_left; });
}

std::optional<FilterResult> Filters::result(std::size_t i) const {
  const State& its = states_[i];
  if (its.has_left || !its.has_started) {
    return std::nullopt;
  }
  FilterResult result = its.result;
  Eigen::Matrix<double, kConstants, kConstants> root;
  for (int row = 0; row < kConstants; ++row) {
    for (int column = 0; column < kConstants; ++column) {
      root(row, column) = filter_->root[(kMoving + row) * kColumns + kMoving + column][i];
    }
  }
  const Eigen::MatrixXd inverse =
      root.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(kConstants, kConstants));
  result.covariance = inverse * inverse.transpose();
  result.error.resize(kConstants);
  for (int k = 0; k < kGyros; ++k) {
    const sim::Gyro& truth = lanes_[i]->gyros[static_cast<std::size_t>(k)];
    for (int c = 0; c < kCoefficients; ++c) {
      result.error(drift_of(k) - kMoving + c) = filter_->gyro[k].kappa_rad_s[c][i] - truth.drift().kappa_rad_s()(c);
    }
    const Eigen::Matrix3d C_c_b = matrix_of(filter_->gyro[k].C_c_b, i);
    result.error.segment<3>(alignment_of(k) - kMoving) =
        Rot<C, C>::assume(Eigen::Matrix3d(C_c_b * truth.alignment().raw().transpose())).log().raw();
  }
  const double count = errors_.count[i];
  result.attitude_rms_rad = (vector_of(errors_.squares_rad2, i) / count).cwiseSqrt();
  result.attitude_normalised_square = errors_.normalised[i] / count;
  const bool is_sound =
      result.error.allFinite() && result.covariance.allFinite() && result.attitude_rms_rad.allFinite();
  return is_sound ? std::optional(std::move(result)) : std::nullopt;
}

}  // namespace

Lane::Lane(const FilterFlight& flight, const Lane* before)
    : scenario(&flight.scenario),
      begin_s(-sim::margin_s(flight.scenario)),
      end_s(to_seconds(flight.scenario.duration) + sim::margin_s(flight.scenario)),
      ephemeris(sim::ephemeris_of(flight.scenario.orbit, begin_s, end_s)),
      attitude(
          before != nullptr
              ? sim::AttitudeProgramme(scenario->attitude, before->attitude.reference(), scenario->seed, begin_s, end_s)
              : sim::AttitudeProgramme(scenario->attitude, *ephemeris, scenario->seed, begin_s, end_s)),
      estimator(estimator_of(flight)) {
  const Scenario& its = flight.scenario;
  for (int k = 0; k < kGyros; ++k) {
    gyros.emplace_back(its.gyros[static_cast<std::size_t>(k)], attitude.at(0), its.seed, k);
    readout_noise.emplace_back(its.seed, sim::Source::kReadoutNoise, static_cast<std::uint64_t>(k));
  }
  const sim::Sky sky(its.epoch, begin_s, end_s);
  std::vector<sim::Event> events;
  fixes = sim::simulate_fixes(its.star_tracker, {attitude, *ephemeris, sky}, its.epoch, its.duration,
                              its.star_tracker_period, its.seed, events);
}

bool Lane::has_reference_of(const Scenario& other) const {
  using Reference = AttitudeScenario::Reference;
  const Reference reference = scenario->attitude.reference;
  const auto orbit = [](const Scenario& its) {
    const OrbitScenario& of = its.orbit;
    return std::tuple(of.perigee_altitude_m, of.apogee_altitude_m, of.inclination_rad, of.ascending_node_rad,
                      of.argument_of_perigee_rad, of.mean_anomaly_rad, its.duration, sim::margin_s(its));
  };
  return (reference == Reference::kOrbital || reference == Reference::kYawSteered) &&
         reference == other.attitude.reference && scenario->orbit.ephemeris.empty() && other.orbit.ephemeris.empty() &&
         orbit(*scenario) == orbit(other);
}

bool Lane::turns_by_little() const {
  return std::ranges::all_of(gyros, [&](const sim::Gyro& gyro) {
    const double most_rad_s = gyro.drift().kappa_rad_s().cwiseAbs().sum();
    return most_rad_s * to_seconds(scenario->gyro_period) < kLittle_rad;
  });
}

bool Lane::is_like(const Lane& other) const {
  const auto times = [](const Lane& its) {
    const std::optional<sim::SmoothNoise>& jitter = its.attitude.jitter();
    return std::tuple(its.scenario->epoch, its.scenario->duration, its.scenario->gyro_period,
                      its.scenario->star_tracker_period, jitter.has_value(), jitter ? jitter->knots_per_s() : 0);
  };
  return times(*this) == times(other);
}

std::vector<std::optional<FilterResult>> fly_pack(std::span<Lane* const> lanes, const Kernels& kernels) {
  constexpr std::size_t kKept = 256;  // samples
  static_assert(kKept > 2 * Readings<kGyros>::kCapacity);
  const Scenario& scenario = *lanes.front()->scenario;
  const CalibrationSetup& setup = lanes.front()->estimator->setup();
  const double period_s = to_seconds(scenario.gyro_period);
  const auto reach = static_cast<int>(setup.reach() / scenario.gyro_period);
  const auto samples = static_cast<int>(scenario.duration / scenario.gyro_period) + 1;
  const auto between_fixes = static_cast<int>(scenario.star_tracker_period / scenario.gyro_period);
  Simulation simulation(lanes, kernels);
  Filters filters(lanes, kernels);
  // Twice, so that those around any sample lie one after the other.
  std::vector<Kept> kept(2 * kKept);
  std::vector<M3> truth(kKept);  // at fixes
  const auto at = [&](int sample) { return static_cast<std::size_t>(sample) % kKept; };
  int simulated = 0;
  int fit_first = 1;
  int fit_last = -1;
  std::optional<FitOfTimes> fit;
  for (int i = 0; i < samples; ++i) {
    for (; simulated <= std::min(i + reach, samples - 1); ++simulated) {
      Kept& its = kept[at(simulated)];
      simulation.next(its.h_b);
      kept[at(simulated) + kKept] = its;
      if (simulated % between_fixes == 0) {
        truth[at(simulated)] = simulation.C_in_c();
      }
    }
    const Kept& its = kept[at(i)];
    filters.predict(its.h_b, i == 0 ? 0 : period_s);
    if (i % between_fixes != 0) {
      continue;
    }
    check_stop();
    const int first = std::max(-reach, -i);
    const int last = std::min(reach, samples - 1 - i);
    if (!fit || first != fit_first || last != fit_last) {
      fit.emplace(first, last, period_s);
      fit_first = first;
      fit_last = last;
    }
    // All that the on-board step keeps.
    const int kept_before = std::min(i, Readings<kGyros>::kCapacity - 1 - last);
    const Kept* of_fix = &kept[at(i - kept_before) + static_cast<std::size_t>(kept_before)];
    filters.fix(scenario.epoch + i * scenario.gyro_period, fit->through(&of_fix[first].h_b),
                {of_fix, -kept_before, last, scenario.gyro_period}, truth[at(i)]);
    if (filters.have_all_left()) {
      break;
    }
  }
  filters.end(scenario.epoch + (samples - 1) * scenario.gyro_period);
  std::vector<std::optional<FilterResult>> results;
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    results.push_back(filters.result(i));
  }
  return results;
}

}  // namespace trihedron::lanes
