#pragma once
/// Prediction of the momenta: dh_in/dt = ω_in × h_in, ω_in = C_in_b ω_b(h_b), and its linearised sensitivities
/// (docs/mathematics.md, section 6).

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "trihedron/core/columns.hpp"
#include "trihedron/core/drift.hpp"
#include "trihedron/core/frames.hpp"
#include "trihedron/core/gyro_readout.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron {

/// Estimates of one gyro, as plain numbers with frames in the names. There is room for Max drift columns.
template <int Max>
struct GyroModel : GyroReadout {
  using Coefficients = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, Max, 1>;

  Eigen::Vector3d h_in = Eigen::Vector3d::UnitX();  ///< direction of the momentum
  /// Of all columns of the drift model: κ; the drift that wanders; the change of the coefficients of eq. (1).
  Coefficients drift_rad_s = Coefficients::Zero(Layout::kEq1 <= Max ? Layout::kEq1 : Max);
};

/// by_drift ← by_drift + turn × by_drift + dt_C_in_b · basis, column by column; all of the same size.
void advance_by_drift(ColumnsView by_drift, ColumnsView basis, const Eigen::Matrix3d& dt_C_in_b,
                      const Eigen::Vector3d& turn);

/// Linearised effect of three causes on one momentum since a reference epoch:
/// φ(t) = by_start φ(t0) + by_drift Δκ + by_alignment δ, with h(true) = exp([φ×]) h(est), φ in `in`;
/// κ(true) = κ(est) + Δκ, all columns of the drift model; C_c_b(true) = exp([δ×]) C_c_b(est), δ in c.
template <int Max>
struct Sensitivity {
  Eigen::Matrix3d by_start = Eigen::Matrix3d::Identity();
  Columns<Max> by_drift = Columns<Max>::zero();  ///< s
  Eigen::Matrix3d by_alignment = Eigen::Matrix3d::Zero();

  /// At the reference epoch: nothing has moved yet.
  void begin(int columns) {
    by_start.setIdentity();
    by_drift.view(columns).set_zero();
    by_alignment.setZero();
  }
  /// Over one step more, in which the momentum turned by `turn`, rad. C_in_c: the attitude in it; dt_C_in_b: from the
  /// case, times its length, s; basis: columns of the drift in it, padded, as many as by_drift has.
  void advance(ColumnsView basis, const Eigen::Matrix3d& C_in_c, const Eigen::Matrix3d& dt_C_in_b,
               const Eigen::Vector3d& turn) {
    const Eigen::Matrix3d cross = skew<double>(turn);
    by_start += cross * by_start;
    by_alignment += cross * (by_alignment - C_in_c);
    advance_by_drift(by_drift.view(basis.columns), basis, dt_C_in_b, turn);
  }
  /// Makes it that of this stretch followed by `next`.
  void append(const Sensitivity& next, int columns) {
    by_start = (next.by_start * by_start).eval();
    by_drift.first(columns) =
        (next.by_start.lazyProduct(by_drift.first(columns)) + next.by_drift.first(columns)).eval();
    by_alignment = (next.by_start * by_alignment + next.by_alignment).eval();
  }
};

/// A vector whose length is 1 to rounding, without what rounding has added: v (3 − v²)/2, one step of Newton's method
/// for 1/√v², which waits for no root and no quotient. Added up in this order the factor is exactly 1 where v² is off
/// by its last digit alone, so that once is as good as twice.
[[nodiscard]] inline Eigen::Vector3d kept_unit(const Eigen::Vector3d& v) {
  return (2 - (0.5 + 0.5 * v.squaredNorm())) * v;
}

/// Turns one momentum by its drift over `dt_s`, with attitude and reading of the middle of the step (midpoint rule;
/// exact for constant ω_in). C_in_c: attitude; h_b: reading, unit.
template <int Max>
void precess(GyroModel<Max>& gyro, const DriftModel& drift, const Eigen::Matrix3d& C_in_c, const Eigen::Vector3d& h_b,
             const DriftTime& time, double dt_s) {
  const Eigen::Vector3d omega_b = drift.rate(gyro.corrected(h_b), time, gyro.drift_rad_s.data());
  const Eigen::Vector3d omega_in = C_in_c * (gyro.C_c_b * omega_b);
  gyro.h_in = kept_unit(rotated<double>(gyro.h_in, omega_in * dt_s));
}

/// precess(), and the sensitivities beside it: dφ/dt = ω × φ + C_in_b B Δκ + (C_in_c δ) × ω. Returns the rotation that
/// the momentum made, rad.
template <int Max>
Eigen::Vector3d precess(GyroModel<Max>& gyro, Sensitivity<Max>& sensitivity, const DriftModel& drift,
                        const Eigen::Matrix3d& C_in_c, const Eigen::Vector3d& h_b, const DriftTime& time, double dt_s) {
  Columns<Max> columns;
  const int size = drift.columns();
  drift.basis(gyro.corrected(h_b), time, columns.view(size));
  const Eigen::Matrix3d dt_C_in_b = dt_s * (C_in_c * gyro.C_c_b);
  const Eigen::Vector3d turn = dt_C_in_b * columns.view(size).times(gyro.drift_rad_s.data());
  gyro.h_in = kept_unit(rotated<double>(gyro.h_in, turn));
  sensitivity.advance(columns.view(size), C_in_c, dt_C_in_b, turn);
  return turn;
}

/// What moves the momentum of one of two gyros that are predicted together, and the momentum itself: where the numbers
/// lie, matrices column by column.
struct PrecessingGyro {
  double* h_in;
  const double* kappa;  ///< of eq. (1)
  const double* C_c_b;
  const double* readout_bias;
  const double* h_b;

  template <int Max>
  PrecessingGyro(GyroModel<Max>& gyro, const Eigen::Vector3d& reading)
      : h_in(gyro.h_in.data()),
        kappa(gyro.drift_rad_s.data()),
        C_c_b(gyro.C_c_b.data()),
        readout_bias(gyro.readout_bias.data()),
        h_b(reading.data()) {}
};
/// Its sensitivities.
struct SensitivityOfEq1 {
  double* by_start;
  double* by_alignment;
  ColumnsView by_drift;

  template <int Max>
  explicit SensitivityOfEq1(Sensitivity<Max>& its)
      : by_start(its.by_start.data()),
        by_alignment(its.by_alignment.data()),
        by_drift(its.by_drift.view(Esg7::kSize)) {}
};

/// What the sensitivities of two gyros, side by side, gain in some short steps in which the momenta hardly turn: sums
/// over the steps, to which the turn of what is already there is added when they are taken over.
class StepsOfTwo {
 public:
  static constexpr int kMost = 64;
  /// The momenta turn by less in all steps together. What is left out is at most half of that, as a part of a
  /// sensitivity, where one step is much longer than the others; hundredths of it where steps are even, at 8 Hz.
  static constexpr double kMostTurn_rad = 1e-5;

  [[nodiscard]] bool empty() const { return steps_ == 0; }
  void clear() {
    steps_ = 0;
    sums_ = {};
  }
  /// The sensitivities of one of the two over the steps; zero behind the columns of eq. (1).
  template <int Max>
  [[nodiscard]] Sensitivity<Max> of(int which) const {
    Sensitivity<Max> its;
    const Eigen::Matrix3d turn = skew<double>(column(kTurn, which));
    // Each step turns the sums of those before it: of even steps, of n in all, by half of n − 1 of n parts of the turn.
    const Eigen::Matrix3d by_sums = Eigen::Matrix3d::Identity() + 0.5 * (1 - 1 / static_cast<double>(steps_)) * turn;
    its.by_start.noalias() += turn * by_sums;
    auto by_drift = its.by_drift.view(Esg7::kSize);
    for (int i = 0; i < Esg7::kSize; ++i) {
      by_drift.set_column(i, by_sums * column(kDrift + i, which));
    }
    for (int i = 0; i < 3; ++i) {
      its.by_alignment.col(i) = by_sums * column(kAlignment + i, which);
    }
    return its;
  }

 private:
  friend struct PrecessingTwo;
  static constexpr int kTurn = 0;
  static constexpr int kAlignment = 1;
  static constexpr int kDrift = 4;
  static constexpr int kColumns = kDrift + Esg7::kSize;

  /// x, y, z, of each that of one gyro and then that of the other.
  using Column = std::array<double, 6>;

  [[nodiscard]] double* at(int column) { return sums_[static_cast<std::size_t>(column)].data(); }
  [[nodiscard]] Eigen::Vector3d column(int i, int which) const {
    const double* its = sums_[static_cast<std::size_t>(i)].data() + which;
    return {its[0], its[2], its[4]};
  }

  std::array<Column, kColumns> sums_{};
  int steps_ = 0;
};

/// precess() of two gyros side by side whose drift is eq. (1) alone: the same bits in half the instructions.
void precess_two(const PrecessingGyro& a, const PrecessingGyro& b, const Eigen::Matrix3d& C_in_c, double dt_s);
/// The same with sensitivities.
void precess_two(const PrecessingGyro& a, const PrecessingGyro& b, const SensitivityOfEq1& since_a,
                 const SensitivityOfEq1& since_b, const Eigen::Matrix3d& C_in_c, double dt_s);
/// The same, their sensitivities by sums. False, and nothing is done, where there are too many steps or too much of a
/// turn for that.
[[nodiscard]] bool precess_two(const PrecessingGyro& a, const PrecessingGyro& b, StepsOfTwo& steps,
                               const Eigen::Matrix3d& C_in_c, double dt_s);
/// The same of two whose drift has more than the sensitivities to eq. (1) are about: rates ω_b, rad/s, case axes.
void precess_two(const PrecessingGyro& a, const PrecessingGyro& b, const SensitivityOfEq1& since_a,
                 const SensitivityOfEq1& since_b, const Eigen::Matrix3d& C_in_c, double dt_s,
                 const Eigen::Vector3d& rate_a, const Eigen::Vector3d& rate_b);

/// precess() of the first `count` gyros. times(): DriftTimes, what the drift of each depends on; asked only where some
/// gyro does not go in a pair, since the drift of these is eq. (1) alone.
template <class Gyros, class Times>
void precess_all(Gyros& gyros, int count, const DriftModel& drift, const Eigen::Matrix3d& C_in_c, const Directions& h_b,
                 const Times& times, double dt_s) {
  const int in_pairs = drift.columns() == Esg7::kSize ? count - count % 2 : 0;
  for (int k = 0; k < in_pairs; k += 2) {
    precess_two({gyros[k], h_b[k]}, {gyros[k + 1], h_b[k + 1]}, C_in_c, dt_s);
  }
  if (in_pairs < count) {
    const DriftTimes now = times();
    for (int k = in_pairs; k < count; ++k) {
      precess(gyros[k], drift, C_in_c, h_b[k], now[k], dt_s);
    }
  }
}

/// Sensitivities of gyros, of which those that go in pairs are brought up to the present time only where settled.
template <int Max, int N>
class SensitivitiesOfAll {
 public:
  using All = PerGyro<Sensitivity<Max>, N>;

  /// At the reference epoch.
  void begin(int columns) {
    for (Sensitivity<Max>& its : since_) {
      its.begin(columns);
    }
    for (StepsOfTwo& its : steps_) {
      its.clear();
    }
    is_settled_.fill(false);
  }
  /// Brings all to the present time.
  void settle() {
    for (int pair = 0; pair < N / 2; ++pair) {
      settle(pair);
    }
  }
  /// Where settled.
  [[nodiscard]] All& all() { return since_; }
  [[nodiscard]] All at_present() const {
    All its = since_;
    for (int pair = 0; pair < N / 2; ++pair) {
      append_steps(pair, its);
    }
    return its;
  }

  /// precess() of the first `count` gyros, with their sensitivities; times() as above.
  template <class Gyros, class Times>
  void precess_all(Gyros& gyros, int count, const DriftModel& drift, const Eigen::Matrix3d& C_in_c,
                   const Directions& h_b, const Times& times, double dt_s) {
    const int in_pairs = drift.columns() == Esg7::kSize ? count - count % 2 : 0;
    for (int k = 0; k < in_pairs; k += 2) {
      const PrecessingGyro a(gyros[k], h_b[k]);
      const PrecessingGyro b(gyros[k + 1], h_b[k + 1]);
      if (!precess_two(a, b, steps_[static_cast<std::size_t>(k / 2)], C_in_c, dt_s)) {
        settle(k / 2);
        precess_two(a, b, SensitivityOfEq1(since_[k]), SensitivityOfEq1(since_[k + 1]), C_in_c, dt_s);
      }
    }
    if (in_pairs < count) {
      const DriftTimes now = times();
      for (int k = in_pairs; k < count; ++k) {
        precess(gyros[k], since_[k], drift, C_in_c, h_b[k], now[k], dt_s);
      }
    }
  }

 private:
  void settle(int pair) {
    append_steps(pair, since_);
    is_settled_[static_cast<std::size_t>(pair)] = true;
    steps_[static_cast<std::size_t>(pair)].clear();
  }
  void append_steps(int pair, All& since) const {
    const StepsOfTwo& steps = steps_[static_cast<std::size_t>(pair)];
    for (int k = 0; k < 2 && !steps.empty(); ++k) {
      Sensitivity<Max>& its = since[2 * pair + k];
      if (is_settled_[static_cast<std::size_t>(pair)]) {
        its.append(steps.of<Max>(k), Esg7::kSize);
      } else {
        its = steps.of<Max>(k);
      }
    }
  }

  All since_;
  std::array<StepsOfTwo, N / 2> steps_;
  std::array<bool, N / 2> is_settled_{};  ///< before, since the begin
};

/// exp([δ×]) C_c_b, through the quaternion, so that rounding cannot accumulate in the matrix over months of fixes.
[[nodiscard]] Eigen::Matrix3d turned(const Eigen::Matrix3d& C_c_b, const Eigen::Vector3d& delta);

/// First-order Gauss–Markov process.
struct GaussMarkov {
  double sigma = 0;  ///< stationary
  double time_s = 3600;

  /// The fraction of a value that is left after dt_s; not below 1e-6, since its inverse stands in the transition of the
  /// batch.
  [[nodiscard]] double kept(double dt_s) const;
  /// 1-sigma of the noise that has come in its place.
  [[nodiscard]] double noise(double kept) const;
};

/// How far a change of the coefficients has got, as a fraction of the whole; less than none before the time for which
/// the coefficients stand.
struct CourseOfChange {
  enum class Kind : std::uint8_t {
    kEven,    ///< linear in time
    kWarmUp,  ///< fast at first, towards a steady value
    kJump,    ///< all at once
  };

  Kind kind = Kind::kEven;
  Time begin{};               ///< of the stretch of time over which the change is told
  double duration_s = 32400;  ///< of that stretch
  /// Of kWarmUp, in which what is left of it decays to 1/e; of kJump, from the beginning on until it happens.
  double time_s = 0;
  Time zero_at{};  ///< the coefficients stand for this time

  [[nodiscard]] double part(Time t) const;
  /// Its mean over a short step.
  [[nodiscard]] double mean_part(Time from, Time to) const;

 private:
  [[nodiscard]] double since_begin(Time t) const;
};

/// The angle θ by which a rotor has gone along its polhode: 2π ∫ dt / period, the period changing evenly, from half to
/// twice what it was; beyond that it stays.
struct Polhode {
  // Known to parts in ten thousand at best; as floats the object of a pair stays within 32 KiB.
  float period_s = 7200;  ///< where θ = 0
  float period_rate = 0;  ///< seconds per second

  /// θ so long after it was 0.
  [[nodiscard]] double angle_rad(double since_s) const;
  /// The same polhode, told from a later time on; its angles differ by a constant.
  [[nodiscard]] Polhode after(double since_s) const {
    return {static_cast<float>(static_cast<double>(period_s) + static_cast<double>(period_rate) * since_s),
            period_rate};
  }
};

/// Longest step over which the change of the readings tells how far the body turned.
inline constexpr double kQuarterOrbit_s = 1300;

/// Largest error of the midpoint rule, rad, in a step in which the body turned far between two samples: the drift over
/// the step times the turn between the readings `from` and `to`.
[[nodiscard]] double missed_by_long_step_rad(double drift_rad, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                             double dt_s);

}  // namespace trihedron
