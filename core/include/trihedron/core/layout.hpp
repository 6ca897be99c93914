#pragma once
/// Which states an estimator has, and the position of each; the only place where this is defined.

#include <array>
#include <cstddef>
#include <cstdint>

#include "trihedron/core/drift_model.hpp"
#include "trihedron/core/per_gyro.hpp"

namespace trihedron {

/// Star trackers that a spacecraft may have.
inline constexpr int kMaxStarTrackers = 4;

/// The kinds of states that may be estimated in addition to directions, drift coefficients and alignments, in the order
/// of calibration.json.
enum class FurtherState : std::uint8_t {
  kClockOffset,           ///< τ of the star trackers: a fix stamped t gives the attitude at t + τ
  kClockRate,             ///< of the star trackers: τ grows by so many seconds per second
  kOrbitalError,          ///< of each star tracker: exp([(p_s sin nt + p_c cos nt)×]) in c
  kStarTrackerAlignment,  ///< of the star trackers other than the first; always there for those of the layout
  kReadoutBias,           ///< of the direction cosines of each gyro
  kCoefficientChange,     ///< of the coefficients of eq. (1) of each gyro, by the course of the set-up
  kOrbitalDrift,          ///< v_s sin nt + v_c cos nt about the case axes of each gyro
  kPolhode,               ///< of the coefficients of eq. (1) of each gyro: a_s sin θ + a_c cos θ, θ of its polhode
  kWanderingDrift,        ///< first-order Gauss–Markov drift about the case axes of each gyro
};
inline constexpr std::size_t kFurtherStateCount = 9;

/// Which of them are estimated; alignments of star trackers are not a choice.
struct FurtherStates {
  bool wandering_drift = false;
  bool readout_bias = false;
  bool coefficient_change = false;
  bool clock_offset = false;
  bool orbital_error = false;
  bool clock_rate = false;
  bool orbital_drift = false;
  bool polhode = false;

  friend constexpr bool operator==(const FurtherStates&, const FurtherStates&) = default;
};

inline constexpr FurtherStates kAllFurtherStates{true, true, true, true, true, true, true, true};

/// First the states that move, then the constants gyro by gyro, then those that the gyros share.
struct Layout {
  static constexpr int kEq1 = 7;             ///< coefficients of eq. (1), the first ones of each drift model
  static constexpr int kOrbitalError = 6;    ///< amplitudes of the error of a star tracker at orbital period
  static constexpr int kOrbitalDrift = 6;    ///< amplitudes of the drift at orbital period
  static constexpr int kPolhode = 2 * kEq1;  ///< amplitudes of the coefficients with the polhode

  int gyros = 2;
  DriftModelId drift_model{};
  FurtherStates further{};
  int star_trackers = 1;
  /// Components of the error of a direction: 3 in `in`, of which that along the momentum has no effect of its own, or 2
  /// across it.
  int direction_size = 3;
  /// Combinations of the coefficients outside eq. (1) that stand for these; negative: the coefficients themselves.
  int drift_modes = -1;

  friend constexpr bool operator==(const Layout&, const Layout&) = default;

  /// κ of one gyro.
  [[nodiscard]] constexpr int drift_size() const { return drift_modes < 0 ? drift_model.size() : kEq1 + drift_modes; }
  /// Columns of its drift: κ, then the drift that wanders, then the change of the coefficients of eq. (1), then the
  /// drift at orbital period and the coefficients with the polhode, sine before cosine.
  [[nodiscard]] constexpr int drift_columns() const { return polhode_column() + (further.polhode ? kPolhode : 0); }
  [[nodiscard]] constexpr int wandering_column() const { return drift_size(); }
  [[nodiscard]] constexpr int change_column() const { return drift_size() + (further.wandering_drift ? 3 : 0); }
  [[nodiscard]] constexpr int orbital_column() const {
    return change_column() + (further.coefficient_change ? kEq1 : 0);
  }
  [[nodiscard]] constexpr int polhode_column() const {
    return orbital_column() + (further.orbital_drift ? kOrbitalDrift : 0);
  }

  [[nodiscard]] constexpr int direction(int gyro) const { return direction_size * gyro; }
  [[nodiscard]] constexpr int wandering(int gyro) const { return direction(gyros) + 3 * gyro; }
  /// The number of states that move; the first constant.
  [[nodiscard]] constexpr int dynamic() const { return wandering(further.wandering_drift ? gyros : 0); }
  [[nodiscard]] constexpr int drift(int gyro) const { return dynamic() + gyro * (drift_size() + 3); }
  [[nodiscard]] constexpr int alignment(int gyro) const { return drift(gyro) + drift_size(); }
  /// The amplitudes of the drift at orbital period of one gyro, and behind those of all gyros those of the polhode.
  /// With κ and δ, behind which they are, they have a common prior.
  [[nodiscard]] constexpr int orbital_drift(int gyro) const { return drift(gyros) + kOrbitalDrift * gyro; }
  [[nodiscard]] constexpr int polhode(int gyro) const {
    return orbital_drift(further.orbital_drift ? gyros : 0) + kPolhode * gyro;
  }
  /// The errors of the direction cosines of one gyro, those that GyroReadout knows; so far the bias alone.
  [[nodiscard]] constexpr int readout_size() const { return further.readout_bias ? 3 : 0; }
  [[nodiscard]] constexpr int readout(int gyro) const {
    return polhode(further.polhode ? gyros : 0) + readout_size() * gyro;
  }
  [[nodiscard]] constexpr int readout_bias(int gyro) const { return readout(gyro); }
  [[nodiscard]] constexpr int change(int gyro) const { return readout(gyros) + kEq1 * gyro; }
  /// The first state that the gyros share; those before it are the errors that move an attitude by the gyros.
  [[nodiscard]] constexpr int shared() const { return change(further.coefficient_change ? gyros : 0); }
  [[nodiscard]] constexpr int clock_offset(int /*of the pass*/ = 0) const { return shared(); }
  [[nodiscard]] constexpr int clock_rate(int /*of the pass*/ = 0) const {
    return shared() + (further.clock_offset ? 1 : 0);
  }
  [[nodiscard]] constexpr int orbital_error(int head = 0) const {
    return clock_rate() + (further.clock_rate ? 1 : 0) + kOrbitalError * head;
  }
  /// Alignment of star tracker 1, 2 …; the first, 0, has none, since its axes are c.
  [[nodiscard]] constexpr int star_tracker(int head) const {
    return orbital_error(further.orbital_error ? star_trackers : 0) + 3 * (head - 1);
  }
  [[nodiscard]] constexpr int size() const { return star_tracker(star_trackers); }
  [[nodiscard]] constexpr int constants() const { return size() - dynamic(); }
  [[nodiscard]] constexpr int shared_size() const { return size() - shared(); }
  /// κ and δ of all gyros: what calibration.json lists.
  [[nodiscard]] constexpr int parameters() const { return drift(gyros) - dynamic(); }
  /// With the amplitudes of drift that comes back, at orbital period and with the polhode.
  [[nodiscard]] constexpr int drift_parameters() const { return readout(0) - dynamic(); }
  /// The first constant behind κ and δ.
  [[nodiscard]] constexpr int behind_parameters() const { return drift(gyros); }
  /// These amplitudes: the first, and how many.
  [[nodiscard]] constexpr int amplitudes() const { return drift(gyros); }
  [[nodiscard]] constexpr int amplitudes_size() const { return readout(0) - amplitudes(); }

  /// Constants of a gyro's drift beside κ: their columns of its drift, and their states.
  struct Block {
    int column = 0;
    int state = 0;
    int size = 0;  ///< 0: not there
  };
  [[nodiscard]] constexpr std::array<Block, 3> beside_kappa(int gyro) const {
    return {further.coefficient_change ? Block{change_column(), change(gyro), kEq1} : Block{},
            further.orbital_drift ? Block{orbital_column(), orbital_drift(gyro), kOrbitalDrift} : Block{},
            further.polhode ? Block{polhode_column(), polhode(gyro), kPolhode} : Block{}};
  }

  /// Whether states of this kind are there.
  [[nodiscard]] constexpr bool has(FurtherState state) const;
  /// Who has a set of components of its own: gyros or star trackers from `begin` up to `end`, or 0 for the whole pass.
  struct Owners {
    int begin = 0;
    int end = 1;
  };
  [[nodiscard]] constexpr Owners owners(FurtherState state) const;
  /// Position of the first component that an owner has.
  [[nodiscard]] constexpr int first(FurtherState state, int owner) const;
};

/// What the library has to know of a kind of further states.
struct FurtherStateKind {
  /// What has a set of the components of its own.
  enum class Owner : std::uint8_t { kPass, kGyro, kStarTracker, kFurtherStarTracker };

  FurtherState state;
  bool FurtherStates::*flag;  ///< null: not a choice
  Owner owner;
  int size;                         ///< components of each owner
  int (Layout::*first)(int) const;  ///< position of those of an owner
  /// Default 1-sigma of each component before anything is measured, in rad, rad/s, s or s/s. 0: CalibrationSetup has a
  /// member of its own for it.
  double prior_sigma;
};

/// One row for each kind, in the order of FurtherState.
inline constexpr std::array<FurtherStateKind, kFurtherStateCount> kFurtherStateKinds = {{
    {FurtherState::kClockOffset, &FurtherStates::clock_offset, FurtherStateKind::Owner::kPass, 1, &Layout::clock_offset,
     0.1},
    // A quartz oscillator is within 20 ppm or so of its rate; with compensation of its temperature, within some ppm.
    {FurtherState::kClockRate, &FurtherStates::clock_rate, FurtherStateKind::Owner::kPass, 1, &Layout::clock_rate,
     2e-5},
    {FurtherState::kOrbitalError, &FurtherStates::orbital_error, FurtherStateKind::Owner::kStarTracker,
     Layout::kOrbitalError, &Layout::orbital_error, 1e-4},
    {FurtherState::kStarTrackerAlignment, nullptr, FurtherStateKind::Owner::kFurtherStarTracker, 3,
     &Layout::star_tracker, 0},
    {FurtherState::kReadoutBias, &FurtherStates::readout_bias, FurtherStateKind::Owner::kGyro, 3, &Layout::readout_bias,
     1e-4},
    {FurtherState::kCoefficientChange, &FurtherStates::coefficient_change, FurtherStateKind::Owner::kGyro, Layout::kEq1,
     &Layout::change, 1e-7},
    {FurtherState::kOrbitalDrift, &FurtherStates::orbital_drift, FurtherStateKind::Owner::kGyro, Layout::kOrbitalDrift,
     &Layout::orbital_drift, 1e-7},
    {FurtherState::kPolhode, &FurtherStates::polhode, FurtherStateKind::Owner::kGyro, Layout::kPolhode,
     &Layout::polhode, 6e-7},
    {FurtherState::kWanderingDrift, &FurtherStates::wandering_drift, FurtherStateKind::Owner::kGyro, 3,
     &Layout::wandering, 0},
}};

/// Its row in the table.
[[nodiscard]] constexpr const FurtherStateKind& kind_of(FurtherState state) {
  return kFurtherStateKinds[static_cast<std::size_t>(state)];
}

constexpr bool Layout::has(FurtherState state) const {
  const FurtherStateKind& kind = kind_of(state);
  return kind.flag == nullptr ? star_trackers > 1 : further.*kind.flag;
}

constexpr auto Layout::owners(FurtherState state) const -> Owners {
  switch (kind_of(state).owner) {
    case FurtherStateKind::Owner::kGyro:
      return {0, gyros};
    case FurtherStateKind::Owner::kStarTracker:
      return {0, star_trackers};
    case FurtherStateKind::Owner::kFurtherStarTracker:
      return {1, star_trackers};
    case FurtherStateKind::Owner::kPass:
      break;
  }
  return {};
}

constexpr int Layout::first(FurtherState state, int owner) const { return (this->*kind_of(state).first)(owner); }

/// Storage of an estimator: enough for every layout that has no more of anything than the largest one it is made for.
struct Capacity {
  int gyros = 0;
  int drift_columns = 0;
  int states = 0;
  int dynamic = 0;  ///< of the states, those that move
  int star_trackers = 0;
  int shared_states = 0;         ///< of the states, those that the gyros share
  bool fix_covariances = false;  ///< each fix may come with its own; else the noise of the set-up is that of all

  [[nodiscard]] static constexpr Capacity of(const Layout& largest, bool fix_covariances = false) {
    return {largest.gyros,         largest.drift_columns(), largest.size(), largest.dynamic(),
            largest.star_trackers, largest.shared_size(),   fix_covariances};
  }
  [[nodiscard]] constexpr bool holds(const Layout& layout) const {
    return layout.gyros >= 2 && layout.gyros <= gyros && layout.drift_columns() <= drift_columns &&
           layout.size() <= states && layout.dynamic() <= dynamic && layout.star_trackers >= 1 &&
           layout.star_trackers <= star_trackers && layout.shared_size() <= shared_states;
  }
};

/// Two gyros with eq. (1) and one star tracker.
inline constexpr Capacity kPairCapacity = Capacity::of(Layout{});
/// The same with a third gyro.
inline constexpr Capacity kTrioCapacity = Capacity::of(Layout{.gyros = 3});
/// Everything that is estimated on board.
inline constexpr Layout kLargestLayout{.gyros = kMaxGyros,
                                       .drift_model = vsh(DriftModelId::kMaxDegreeOnBoard),
                                       .further = kAllFurtherStates,
                                       .star_trackers = kMaxStarTrackers};
inline constexpr Capacity kFullCapacity = Capacity::of(kLargestLayout, true);
/// Everything that is estimated by a whole pass.
inline constexpr Capacity kPassCapacity = Capacity::of({.gyros = kMaxGyros,
                                                        .drift_model = vsh(DriftModelId::kMaxDegree),
                                                        .further = kAllFurtherStates,
                                                        .star_trackers = kMaxStarTrackers});
inline constexpr int kMaxDriftColumns = kPassCapacity.drift_columns;
/// Offset and rate of the clock, errors at orbital period, alignments of further star trackers.
inline constexpr int kMaxSharedStates = kLargestLayout.shared_size();
/// Components of a fix: two across each momentum.
inline constexpr int kMaxComponents = 2 * kMaxGyros;

}  // namespace trihedron
