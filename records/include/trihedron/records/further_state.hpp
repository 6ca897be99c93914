#pragma once
/// What can be estimated beside drift coefficients and alignments. Settings, calibration.json, texts and report take
/// what they need from the one table here.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

namespace trihedron {

/// In the order in which calibration.json has them.
enum class FurtherState : std::uint8_t {
  kClockOffset,
  kOrbitalError,
  kStarTrackerAlignment,
  kReadoutBias,
  kCoefficientChange,
  kWanderingDrift,
};
inline constexpr std::size_t kFurtherStateCount = 6;

enum class Unit : std::uint8_t { kSecond, kRadian, kRadianPerSecond };

/// One kind of further states.
struct FurtherStateRow {
  /// What has a set of the components of its own.
  enum class Owner : std::uint8_t { kPass, kGyro, kFurtherStarTracker };

  FurtherState state;
  /// In settings and evidence: "clock_offset". Empty where it is not for settings to choose: further star trackers are
  /// there or not.
  std::string_view key;
  std::string_view label;  ///< for people, as the begin of a sentence
  std::string_view about;  ///< for people, beside the key in the settings
  Owner owner;
  Unit unit;
  int size;  ///< components, of each owner
  /// Of each component, in its unit; of kCoefficientChange as a part of that of the coefficient itself. 0: told by the
  /// pass or the settings.
  double prior_sigma;
  /// In calibration.json, each with its unit at the end; after the owner's name where that is not the pass. None where
  /// the values are not given, since they do not last.
  std::span<const std::string_view> components;
};

namespace further_state_components {
inline constexpr std::array<std::string_view, 1> kClockOffset = {"clock_offset_s"};
inline constexpr std::array<std::string_view, 6> kOrbitalError = {"orbital_sine_x_rad",   "orbital_sine_y_rad",
                                                                  "orbital_sine_z_rad",   "orbital_cosine_x_rad",
                                                                  "orbital_cosine_y_rad", "orbital_cosine_z_rad"};
inline constexpr std::array<std::string_view, 3> kStarTrackerAlignment = {"align_x_rad", "align_y_rad", "align_z_rad"};
inline constexpr std::array<std::string_view, 3> kReadoutBias = {"readout_bias_x_rad", "readout_bias_y_rad",
                                                                 "readout_bias_z_rad"};
inline constexpr std::array<std::string_view, 7> kCoefficientChange = {
    "k0_change_rad_s",   "mu12_change_rad_s", "mu23_change_rad_s", "mu31_change_rad_s",
    "nu12_change_rad_s", "nu23_change_rad_s", "nu31_change_rad_s"};
}  // namespace further_state_components

inline constexpr std::array<FurtherStateRow, kFurtherStateCount> kFurtherStates = {{
    {FurtherState::kClockOffset, "clock_offset", "Clock offset", "of the star tracker", FurtherStateRow::Owner::kPass,
     Unit::kSecond, 1, 0.1, further_state_components::kClockOffset},
    {FurtherState::kOrbitalError, "orbital_error", "Error at orbital period", "of the star tracker, at orbital period",
     FurtherStateRow::Owner::kPass, Unit::kRadian, 6, 1e-4, further_state_components::kOrbitalError},
    {FurtherState::kStarTrackerAlignment, "", "Alignment of a further star tracker", "",
     FurtherStateRow::Owner::kFurtherStarTracker, Unit::kRadian, 3, 0, further_state_components::kStarTrackerAlignment},
    {FurtherState::kReadoutBias, "readout_bias", "Bias of the direction cosines", "of the direction cosines",
     FurtherStateRow::Owner::kGyro, Unit::kRadian, 3, 1e-4, further_state_components::kReadoutBias},
    {FurtherState::kCoefficientChange, "coefficient_change", "Change of the coefficients",
     "of eq. (1), evenly over the pass, by estimator batch", FurtherStateRow::Owner::kGyro, Unit::kRadianPerSecond, 7,
     0.05, further_state_components::kCoefficientChange},
    {FurtherState::kWanderingDrift,
     "wandering_drift",
     "Drift that wanders",
     "about each case axis",
     FurtherStateRow::Owner::kGyro,
     Unit::kRadianPerSecond,
     3,
     0,
     {}},
}};

[[nodiscard]] constexpr const FurtherStateRow& row_of(FurtherState state) {
  return kFurtherStates[static_cast<std::size_t>(state)];
}

}  // namespace trihedron
