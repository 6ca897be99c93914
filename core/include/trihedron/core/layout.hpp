#pragma once
/// Which states an estimator has, and where each of them stands. The one place that knows.

#include "trihedron/core/drift_model.hpp"
#include "trihedron/core/per_gyro.hpp"
#include "trihedron/core/telemetry.hpp"

namespace trihedron {

/// What may be estimated beside directions, drift coefficients, alignments, and the alignments of star trackers beside
/// the first.
struct FurtherStates {
  bool wandering_drift = false;     ///< first-order Gauss–Markov drift about the case axes of each gyro
  bool readout_bias = false;        ///< of the direction cosines of each gyro
  bool coefficient_change = false;  ///< of the coefficients of eq. (1), evenly in time
  bool clock_offset = false;        ///< τ of the star trackers: a fix stamped t holds the attitude at t + τ
  bool orbital_error = false;       ///< of the first star tracker: exp([(p_s sin nt + p_c cos nt)×]) in c

  friend constexpr bool operator==(const FurtherStates&, const FurtherStates&) = default;
};

inline constexpr FurtherStates kAllFurtherStates{true, true, true, true, true};

/// First the states that move, then the constants gyro by gyro, then those that the gyros share.
struct Layout {
  static constexpr int kEq1 = 7;  ///< coefficients of eq. (1), the first ones of each drift model

  int gyros = 2;
  DriftModelId drift_model{};
  FurtherStates further{};
  int star_trackers = 1;
  /// Components of the error of a direction: 3 in `in`, of which that along the momentum means nothing, or 2 across it.
  int direction_size = 3;

  friend constexpr bool operator==(const Layout&, const Layout&) = default;

  /// κ of one gyro.
  [[nodiscard]] constexpr int drift_size() const { return drift_model.size(); }
  /// All that its drift is linear in: κ, the drift that wanders, the change of the coefficients of eq. (1).
  [[nodiscard]] constexpr int drift_columns() const {
    return drift_size() + (further.wandering_drift ? 3 : 0) + (further.coefficient_change ? kEq1 : 0);
  }
  [[nodiscard]] constexpr int wandering_column() const { return drift_size(); }
  [[nodiscard]] constexpr int change_column() const { return drift_size() + (further.wandering_drift ? 3 : 0); }

  [[nodiscard]] constexpr int direction(int gyro) const { return direction_size * gyro; }
  [[nodiscard]] constexpr int wandering(int gyro) const { return direction(gyros) + 3 * gyro; }
  /// The number of states that move; the first constant.
  [[nodiscard]] constexpr int dynamic() const { return wandering(further.wandering_drift ? gyros : 0); }
  [[nodiscard]] constexpr int drift(int gyro) const { return dynamic() + gyro * (drift_size() + 3); }
  [[nodiscard]] constexpr int alignment(int gyro) const { return drift(gyro) + drift_size(); }
  [[nodiscard]] constexpr int readout_bias(int gyro) const { return drift(gyros) + 3 * gyro; }
  [[nodiscard]] constexpr int change(int gyro) const {
    return readout_bias(further.readout_bias ? gyros : 0) + kEq1 * gyro;
  }
  /// The first state that the gyros share; those before it are the errors that move an attitude by the gyros.
  [[nodiscard]] constexpr int shared() const { return change(further.coefficient_change ? gyros : 0); }
  [[nodiscard]] constexpr int clock_offset() const { return shared(); }
  [[nodiscard]] constexpr int orbital_error() const { return shared() + (further.clock_offset ? 1 : 0); }
  /// Alignment of star tracker 1, 2 … beside the first, which is 0.
  [[nodiscard]] constexpr int star_tracker(int head) const {
    return orbital_error() + (further.orbital_error ? 6 : 0) + 3 * (head - 1);
  }
  [[nodiscard]] constexpr int size() const { return star_tracker(star_trackers); }
  [[nodiscard]] constexpr int constants() const { return size() - dynamic(); }
  [[nodiscard]] constexpr int shared_size() const { return size() - shared(); }
  /// κ and δ of all gyros: what calibration.json lists.
  [[nodiscard]] constexpr int parameters() const { return drift(gyros) - dynamic(); }
};

/// The room that an estimator has: no Layout needs more than the one it is made for.
struct Capacity {
  int gyros = 0;
  int drift_columns = 0;
  int states = 0;
  int star_trackers = 0;

  [[nodiscard]] static constexpr Capacity of(const Layout& largest) {
    return {largest.gyros, largest.drift_columns(), largest.size(), largest.star_trackers};
  }
  [[nodiscard]] constexpr bool holds(const Layout& layout) const {
    return layout.gyros >= 2 && layout.gyros <= gyros && layout.drift_columns() <= drift_columns &&
           layout.size() <= states && layout.star_trackers >= 1 && layout.star_trackers <= star_trackers;
  }
};

/// Two gyros with eq. (1) and one star tracker.
inline constexpr Capacity kPairCapacity = Capacity::of(Layout{});
/// Everything.
inline constexpr Layout kLargestLayout{.gyros = kMaxGyros,
                                       .drift_model = vsh(DriftModelId::kMaxDegree),
                                       .further = kAllFurtherStates,
                                       .star_trackers = kMaxStarTrackers};
inline constexpr Capacity kFullCapacity = Capacity::of(kLargestLayout);
inline constexpr int kMaxDriftColumns = kFullCapacity.drift_columns;
/// Clock offset, error at orbital period, alignments of further star trackers.
inline constexpr int kMaxSharedStates = kLargestLayout.shared_size();
/// Components of a fix: two across each momentum.
inline constexpr int kMaxComponents = 2 * kMaxGyros;

}  // namespace trihedron
