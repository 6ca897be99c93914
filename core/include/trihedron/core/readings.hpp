#pragma once
/// The latest gyro samples, and what the gyros read at any time between them.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <optional>

#include "trihedron/core/directions_fit.hpp"
#include "trihedron/core/fix_readings.hpp"
#include "trihedron/core/gyro_health.hpp"
#include "trihedron/core/optimal_attitude.hpp"
#include "trihedron/core/setup.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// Between two readings, of `gyros` gyros.
[[nodiscard]] Directions between(const Directions& a, const Directions& b, double fraction, int gyros);

/// Buffer of the latest kCapacity samples, screened and of unit length, kGyros directions each; the oldest is dropped.
/// Samples that come less than min_spacing() after the last one are not taken, so that the buffer covers the time that
/// is needed at any rate.
template <int kGyros>
class Readings {
 public:
  static constexpr int kCapacity = 80;
  static constexpr Duration kMinSpacing = std::chrono::milliseconds(75);

  Readings() = default;
  /// `together`: whether all samples around a time are fitted, or only the two next to it interpolated.
  Readings(const CalibrationSetup& setup, bool together)
      : gyros_(setup.layout.gyros),
        max_interpolation_(setup.max_interpolation()),
        reach_(together ? setup.reach() : Duration::zero()),
        recent_(together ? setup.recent() : Duration::zero()) {}

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] bool full() const { return size_ == kCapacity; }
  /// i = 0 is the oldest.
  [[nodiscard]] Time time(int i) const { return at(i).t; }
  [[nodiscard]] Directions directions(int i) const {
    const Stored& stored = at(i);
    Directions h_b;
    for (int k = 0; k < gyros_; ++k) {
      h_b[k] = stored.h_b[k];
    }
    return h_b;
  }
  /// Of the latest sample; needs one.
  [[nodiscard]] Time latest_t() const { return time(size_ - 1); }
  [[nodiscard]] std::optional<Time> latest() const { return size_ > 0 ? std::optional(latest_t()) : std::nullopt; }
  [[nodiscard]] Directions latest_directions() const { return directions(size_ - 1); }

  /// Whether a sample comes sooner than there is room for.
  [[nodiscard]] bool too_soon(Time t) const { return size_ > 0 && t - latest_t() < min_spacing(); }
  /// The longest that a sample is needed is by the angles between the momenta: they wait for three times `reach`, and
  /// their work may then be spread over CorrectionPolicy::kMostSpread samples.
  [[nodiscard]] Duration min_spacing() const { return std::max(kMinSpacing, reach_ / kSpacingsOfReach); }

  void push(const GyroSample& sample) {
    if (full()) {
      first_ = (first_ + 1) % kCapacity;
      --size_;
    }
    Stored& stored = samples_[index(size_)];
    stored.t = sample.t;
    for (int k = 0; k < gyros_; ++k) {
      stored.h_b[k] = sample.h_b[k];
    }
    ++size_;
  }
  void clear() { size_ = 0; }

  /// Index of the first sample after `t`.
  [[nodiscard]] int first_after(Time t) const {
    int i = size_;
    while (i > 0 && time(i - 1) > t) {
      --i;
    }
    return i;
  }

  /// Readings at `t`, by a cubic through the samples round it, or between the two next to it; nothing where there are
  /// none close enough. Where no cubic explains them, a gyro is not used whose reading next to `t` is a spike. `gyros`:
  /// their estimates, for the rate of the body.
  template <class Gyros>
  [[nodiscard]] std::optional<FittedReadings> at(Time t, const CalibrationSetup& setup,
                                                 const GyroHealth<kGyros>& health, const Gyros& gyros) const {
    const int after = first_after(t);
    if (after == 0) {
      return std::nullopt;
    }
    FittedReadings readings;
    const Time before_t = time(after - 1);
    if (before_t == t) {
      readings.used = health.usable(before_t, t);
      readings.h_b = directions(after - 1);
    } else if (after < size_ && time(after) - before_t <= max_interpolation_) {
      const Time next_t = time(after);
      readings.used = health.usable(before_t, next_t);
      readings.h_b = between(directions(after - 1), directions(after),
                             to_seconds(t - before_t) / to_seconds(next_t - before_t), gyros_);
    } else {
      return std::nullopt;
    }
    if (!fit(t, reach_, after, 3, setup, health, gyros, readings)) {
      leave_out_spikes(after - 1, before_t == t ? after - 1 : after, t + reach_, setup, gyros, readings);
    }
    return readings;
  }

  /// Readings at the latest sample; needs one. Where no polynomial explains the samples up to it, a gyro whose latest
  /// reading alone leads elsewhere than those before it is not used.
  template <class Gyros>
  [[nodiscard]] FittedReadings now(const CalibrationSetup& setup, const GyroHealth<kGyros>& health,
                                   const Gyros& gyros) const {
    FittedReadings readings;
    readings.used = health.usable(latest_t(), latest_t());
    readings.h_b = latest_directions();
    if (!fit(latest_t(), recent_, size_, 2, setup, health, gyros, readings)) {
      leave_out_spikes_now(setup, gyros, readings);
    }
    return readings;
  }

 private:
  static constexpr int kSpacingsOfReach = 19;
  struct Stored {
    Time t{};
    PerGyro<Eigen::Vector3d, kGyros> h_b;
  };
  [[nodiscard]] std::size_t index(int i) const { return static_cast<std::size_t>((first_ + i) % kCapacity); }
  [[nodiscard]] const Stored& at(int i) const { return samples_[index(i)]; }

  /// Fits a polynomial to the samples within `reach` to both sides of `t`, if they are more than it needs and it
  /// explains them; whether it does. `after`: the first of them after `t`.
  template <class Gyros>
  bool fit(Time t, Duration reach, int after, int degree, const CalibrationSetup& setup,
           const GyroHealth<kGyros>& health, const Gyros& gyros, FittedReadings& readings) const {
    const auto adjacent = [&](int i) { return time(i + 1) - time(i) <= max_interpolation_; };
    int begin = after - 1;
    while (begin > 0 && t - time(begin - 1) <= reach && adjacent(begin - 1)) {
      --begin;
    }
    int end = after;
    while (end < size_ && time(end) - t <= reach && adjacent(end - 1)) {
      ++end;
    }
    if (end - begin < DirectionsFit::least_samples(degree)) {
      return false;
    }
    const GyroMask used = health.usable(time(begin), time(end - 1));
    if (count(used) < 2) {
      return false;
    }
    const auto [one, other] = first_two(used);
    const auto& a = gyros[one];
    const auto& b = gyros[other];
    const auto cosine = [&, i = one, j = other](const Directions& h_b) { return a.in_c(h_b[i]).dot(b.in_c(h_b[j])); };
    DirectionsFit fit(t, time(begin), time(end - 1), end - begin, degree, gyros_);
    for (int i = begin; i < end; ++i) {
      const Directions h_b = directions(i);
      fit.add(time(i), h_b, cosine(h_b));
    }
    const FittedDirections fitted = fit.solve();
    if (!fitted.explains(used, setup.readout_noise_rad)) {
      return false;
    }
    readings.unfollowed = fitted.unfollowed(one, other, cosine(fitted.h_b), setup.readout_noise_rad);
    readings.used = used;
    readings.h_b = fitted.h_b;
    readings.noise_factor = fitted.noise_factor;
    Directions h_c;
    Directions h_c_rate;
    for (int k = 0; k < gyros_; ++k) {
      h_c[k] = gyros[k].in_c(fitted.h_b[k]);
      h_c_rate[k] = gyros[k].C_c_b * fitted.h_b_rate[k];
    }
    readings.rate_c = rate_by_directions(h_c, h_c_rate, used);
    return true;
  }

  /// Squared deviation, in its variance of two components, above which a reading does not belong to others: once in
  /// 3e6.
  static constexpr double kSpike = 30;
  /// Samples before one that it is compared with, or spacings of them.
  static constexpr int kCompared = 4;
  /// Samples on one side of a reading through which a parabola is laid, or half as many.
  static constexpr int kNeighbours = 16;
  static constexpr int kQuadratic = 2;

  /// Leaves out each gyro whose latest reading leads elsewhere. Where the one before it did so as well, the body may
  /// have begun to move in another way: it then turns all momenta alike, and the angles between them stay.
  template <class Gyros>
  void leave_out_spikes_now(const CalibrationSetup& setup, const Gyros& gyros, FixReadings& readings) const {
    const int latest = size_ - 1;
    const GyroMask used = readings.used;
    const auto continues = [&](int i, int k) {
      const Agreement found = with_neighbours(i, -1, k, setup, latest_t());
      return found.agree >= std::min(found.compared, 2);
    };
    for (int k = 0; k < gyros_; ++k) {
      readings.used[k] = used[k] && (continues(latest, k) ||
                                     (!continues(latest - 1, k) && keeps_angles(latest, k, setup, gyros, used)));
    }
  }

  /// Leaves out each gyro whose reading in one of the samples `first` and `last` leads elsewhere both than those before
  /// it and than those after it, up to `until`. Where the samples beside it do so as well, the body moves in a way that
  /// no parabola follows, and again the angles stay.
  template <class Gyros>
  void leave_out_spikes(int first, int last, Time until, const CalibrationSetup& setup, const Gyros& gyros,
                        FixReadings& readings) const {
    const GyroMask used = readings.used;
    const auto belongs = [&](int i, int k) {
      const Agreement before = with_neighbours(i, -1, k, setup, until);
      const Agreement after = with_neighbours(i, 1, k, setup, until);
      const auto agrees = [](const Agreement& side) {
        return side.compared > 0 && side.agree >= std::min(side.compared, 2);
      };
      return agrees(before) || agrees(after) || before.compared + after.compared == 0;
    };
    for (int k = 0; k < gyros_; ++k) {
      for (int i = first; i <= last; ++i) {
        const bool alone = i == 0 || i + 1 == size_ || belongs(i - 1, k) || belongs(i + 1, k);
        readings.used[k] = readings.used[k] && (belongs(i, k) || (!alone && keeps_angles(i, k, setup, gyros, used)));
      }
    }
  }

  /// How many parabolas a reading was compared with, and with how many it agrees.
  struct Agreement {
    int compared = 0;
    int agree = 0;
  };

  /// The reading of a gyro in sample i, compared with those before it (`side` −1) or after it (1), as far as
  /// setup.recent() and not after `until`. With one parabola through them all, if it explains them: it tells the most.
  /// Otherwise with those through some three of them, one, two … samples apart: two that agree are enough, so that a
  /// spike among the neighbours does not count, and one where there are no more.
  [[nodiscard]] Agreement with_neighbours(int i, int side, int gyro, const CalibrationSetup& setup, Time until) const {
    const double noise_square = setup.readout_noise_rad[gyro] * setup.readout_noise_rad[gyro];
    const auto within = [&](int j) {
      return j >= 0 && j < size_ && (time(j) - time(i)) * side <= setup.recent() && time(j) <= until;
    };
    for (int most = kNeighbours; most >= DirectionsFit::least_samples(kQuadratic); most /= 2) {
      int count = 0;
      for (int next = 1; next <= most && within(i + side * next); ++next) {
        count = next;
      }
      if (const auto found = by_all_neighbours(i, side, count, gyro, setup)) {
        return *found;
      }
    }
    Agreement found;
    for (int apart = 1; apart <= kCompared; ++apart) {
      const int step = side * apart;
      const int farthest = i + 3 * step;
      if (!within(farthest)) {
        break;
      }
      const double t = to_seconds(time(i + step) - time(i));
      const double u = to_seconds(time(i + 2 * step) - time(i));
      const double v = to_seconds(time(farthest) - time(i));
      const Eigen::Vector3d weights(u * v / ((u - t) * (v - t)), t * v / ((t - u) * (v - u)),
                                    t * u / ((t - v) * (u - v)));
      const Eigen::Vector3d off = at(i).h_b[gyro] - weights(0) * at(i + step).h_b[gyro] -
                                  weights(1) * at(i + 2 * step).h_b[gyro] - weights(2) * at(farthest).h_b[gyro];
      const double limit = kSpike * noise_square * (1 + weights.squaredNorm());
      found.agree += off.squaredNorm() <= limit ? 1 : 0;
      ++found.compared;
    }
    return found;
  }

  /// With the parabola through the `count` samples next to it on one side; nothing where they are too few or it does
  /// not explain them.
  [[nodiscard]] std::optional<Agreement> by_all_neighbours(int i, int side, int count, int gyro,
                                                           const CalibrationSetup& setup) const {
    if (count < DirectionsFit::least_samples(kQuadratic)) {
      return std::nullopt;
    }
    // As the only gyro.
    DirectionsFit fit(time(i), time(i + side), time(i + side * count), count, kQuadratic, 1);
    Directions its;
    for (int j = 1; j <= count; ++j) {
      its[0] = at(i + side * j).h_b[gyro];
      fit.add(time(i + side * j), its);
    }
    const FittedDirections fitted = fit.solve();
    PerGyro<double> noise_rad{};
    noise_rad[0] = setup.readout_noise_rad[gyro];
    if (!fitted.explains(all_gyros(1), noise_rad)) {
      return std::nullopt;
    }
    const double limit = kSpike * noise_rad[0] * noise_rad[0] * (1 + fitted.noise_factor * fitted.noise_factor);
    return Agreement{1, (at(i).h_b[gyro] - fitted.h_b[0]).squaredNorm() <= limit ? 1 : 0};
  }

  /// Whether the angle of a gyro's momentum to one of the others, by the readings of sample i, is that by two of the
  /// samples before.
  template <class Gyros>
  [[nodiscard]] bool keeps_angles(int sample, int gyro, const CalibrationSetup& setup, const Gyros& gyros,
                                  const GyroMask& used) const {
    const auto cosine = [&](int i, int other) {
      return gyros[gyro].in_c(at(i).h_b[gyro]).dot(gyros[other].in_c(at(i).h_b[other]));
    };
    for (int other = 0; other < gyros_; ++other) {
      const double noise_rad = std::max(setup.readout_noise_rad[gyro], setup.readout_noise_rad[other]);
      int agree = 0;
      for (int i = std::max(sample - kCompared, 0); other != gyro && used[other] && i < sample; ++i) {
        const double moved = cosine(sample, other) - cosine(i, other);
        agree += moved * moved <= kSpike * 4 * noise_rad * noise_rad ? 1 : 0;
      }
      if (agree >= 2) {
        return true;
      }
    }
    return false;
  }

  int gyros_ = 0;
  Duration max_interpolation_{};
  Duration reach_{};   ///< to both sides of a time
  Duration recent_{};  ///< up to the latest sample
  std::array<Stored, static_cast<std::size_t>(kCapacity)> samples_{};
  int first_ = 0;
  int size_ = 0;
};

}  // namespace trihedron
