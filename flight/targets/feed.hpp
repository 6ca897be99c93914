#pragma once
/// A feed: all that the on-board object gets in a pass, as one file of words. First what it is set up with, then the
/// events in the order in which the spacecraft would have them.
///
/// The set-up is given as a sequence by exchange(), which serves writing and reading alike. An event is eight words:
/// kind, time in ns, and for a gyro sample the direction cosines of two gyros, for a fix q_x, q_y, q_z, q_w, the star
/// tracker and 0.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "trihedron/core/on_board.hpp"
#include "word_file.hpp"

namespace trihedron::targets {

inline constexpr std::uint64_t kFeedFormat = 0x31'4445'4546'4854'52;  // "RTHFEED1", least significant byte first
inline constexpr int kMostParameters = kPairCapacity.states;

enum class EventKind : std::uint64_t { kEnd, kGyro, kFix };

struct Event {
  EventKind kind = EventKind::kEnd;
  Time t{};
  std::array<double, 6> values{};

  [[nodiscard]] GyroSample sample() const {
    GyroSample its;
    its.t = t;
    its.h_b[0] = {values[0], values[1], values[2]};
    its.h_b[1] = {values[3], values[4], values[5]};
    return its;
  }
  [[nodiscard]] StarFix fix() const {
    return {t, Eigen::Quaterniond(values[3], values[0], values[1], values[2]), static_cast<int>(values[4])};
  }
};

/// What the on-board object is set up with, for a pair.
struct GivenToFlight {
  using Covariance = Eigen::Matrix<double, kMostParameters, kMostParameters>;

  CalibrationSetup setup;
  PerGyro<GyroModel<kPairCapacity.drift_columns>, 2> prior;
  Covariance covariance = Covariance::Zero();  ///< of the first setup.layout.parameters()
  CorrectionPolicy policy;
};

/// Takes values from a feed.
class FromFeed {
 public:
  explicit FromFeed(WordReader& words) : words_(words) {}
  void operator()(double& value) { value = std::bit_cast<double>(words_.next()); }
  void operator()(Duration& value) { value = Duration(static_cast<std::int64_t>(words_.next())); }
  template <class Integer>
  requires std::is_integral_v<Integer> || std::is_enum_v<Integer>
  void operator()(Integer& value) { value = static_cast<Integer>(words_.next()); }

 private:
  WordReader& words_;
};

/// Puts values into a feed.
class ToFeed {
 public:
  explicit ToFeed(WordWriter& words) : words_(words) {}
  void operator()(double& value) { words_.put(value); }
  void operator()(Duration& value) { words_.put(std::int64_t{value.count()}); }
  template <class Integer>
  requires std::is_integral_v<Integer> || std::is_enum_v<Integer>
  void operator()(Integer& value) { words_.put(static_cast<std::uint64_t>(value)); }

 private:
  WordWriter& words_;
};

template <class Exchange>
void exchange(Exchange& each, Time& t) {
  Duration since_epoch = t.time_since_epoch();
  each(since_epoch);
  t = Time(since_epoch);
}

template <class Exchange, class Matrix>
void exchange_all(Exchange& each, Matrix& matrix) {
  for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
    for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
      each(matrix(row, column));
    }
  }
}

template <class Exchange>
void exchange(Exchange& each, Layout& layout) {
  each(layout.gyros);
  each(layout.drift_model.family);
  each(layout.drift_model.degree);
  each(layout.further.wandering_drift);
  each(layout.further.readout_bias);
  each(layout.further.coefficient_change);
  each(layout.further.clock_offset);
  each(layout.further.orbital_error);
  each(layout.star_trackers);
  each(layout.direction_size);
}

template <class Exchange>
void exchange(Exchange& each, CalibrationSetup& setup) {
  exchange(each, setup.layout);
  for (double& sigma : setup.readout_noise_rad) {
    each(sigma);
  }
  for (StarTrackerSetup& its : setup.star_trackers) {
    exchange_all(each, its.noise_rad);
    exchange_all(each, its.C_c_s);
    each(its.alignment_sigma_rad);
  }
  each(setup.gyro_period);
  each(setup.direction_random_walk_rad_sqrt_s);
  each(setup.wandering_drift.sigma);
  each(setup.wandering_drift.time_s);
  for (const FurtherStateKind& kind : kFurtherStateKinds) {
    each(setup.further_sigma[kind.state]);
  }
  each(setup.change_time_s);
  exchange(each, setup.no_change_at);
  each(setup.orbital_rate_rad_s);
  exchange(each, setup.orbital_phase_zero);
  each(setup.gate_nis);
  each(setup.student_t_freedom);
  each(setup.reopen_after_rejections);
  each(setup.reopen_after_jump_rejections);
  each(setup.restart_within_fixes);
  each(setup.angles_after);
}

template <class Exchange>
void exchange(Exchange& each, GivenToFlight& given) {
  exchange(each, given.setup);
  for (auto& gyro : given.prior) {
    exchange_all(each, gyro.C_c_b);
    exchange_all(each, gyro.readout_bias);
    exchange_all(each, gyro.h_in);
    exchange_all(each, gyro.drift_rad_s);
  }
  exchange_all(each, given.covariance);
  each(given.policy.interval);
  each(given.policy.take_parameters);
  each(given.policy.navigate);
}

template <class Exchange>
void exchange(Exchange& each, Event& event) {
  each(event.kind);
  exchange(each, event.t);
  for (double& value : event.values) {
    each(value);
  }
}

}  // namespace trihedron::targets
