#pragma once
/// Names of what can be estimated in addition to drift coefficients and alignments. Settings, calibration.json, texts
/// and report take what they need from the one table here.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "trihedron/core/layout.hpp"

namespace trihedron {

/// Of a parameter.
enum class Unit : std::uint8_t { kSecond, kSecondPerSecond, kRadian, kRadianPerSecond };

/// One kind of further states, as users meet it.
struct FurtherStateRow {
  FurtherState state;
  /// In settings and evidence: "clock_offset". Empty where it is not for settings to choose: further star trackers are
  /// there or not.
  std::string_view key;
  std::string_view label;  ///< for people, as the begin of a sentence
  std::string_view about;  ///< for people, after the key in the settings
  Unit unit;
  /// In calibration.json, each with its unit at the end; after the owner's name where that is not the pass. None where
  /// the values are not given, since they do not last.
  std::span<const std::string_view> components;
};

/// Names of the components.
namespace further_state_components {
inline constexpr std::array<std::string_view, 1> kClockOffset = {"clock_offset_s"};
inline constexpr std::array<std::string_view, 1> kClockRate = {"clock_rate_s_s"};
inline constexpr std::array<std::string_view, 6> kOrbitalError = {"orbital_sine_x_rad",   "orbital_sine_y_rad",
                                                                  "orbital_sine_z_rad",   "orbital_cosine_x_rad",
                                                                  "orbital_cosine_y_rad", "orbital_cosine_z_rad"};
inline constexpr std::array<std::string_view, 3> kStarTrackerAlignment = {"align_x_rad", "align_y_rad", "align_z_rad"};
inline constexpr std::array<std::string_view, 3> kReadoutBias = {"readout_bias_x_rad", "readout_bias_y_rad",
                                                                 "readout_bias_z_rad"};
inline constexpr std::array<std::string_view, 7> kCoefficientChange = {
    "k0_change_rad_s",   "mu12_change_rad_s", "mu23_change_rad_s", "mu31_change_rad_s",
    "nu12_change_rad_s", "nu23_change_rad_s", "nu31_change_rad_s"};
inline constexpr std::array<std::string_view, 6> kOrbitalDrift = {
    "orbital_drift_sine_x_rad_s",   "orbital_drift_sine_y_rad_s",   "orbital_drift_sine_z_rad_s",
    "orbital_drift_cosine_x_rad_s", "orbital_drift_cosine_y_rad_s", "orbital_drift_cosine_z_rad_s"};
inline constexpr std::array<std::string_view, 14> kPolhode = {
    "k0_polhode_sine_rad_s",     "mu12_polhode_sine_rad_s",   "mu23_polhode_sine_rad_s",   "mu31_polhode_sine_rad_s",
    "nu12_polhode_sine_rad_s",   "nu23_polhode_sine_rad_s",   "nu31_polhode_sine_rad_s",   "k0_polhode_cosine_rad_s",
    "mu12_polhode_cosine_rad_s", "mu23_polhode_cosine_rad_s", "mu31_polhode_cosine_rad_s", "nu12_polhode_cosine_rad_s",
    "nu23_polhode_cosine_rad_s", "nu31_polhode_cosine_rad_s"};
}  // namespace further_state_components

/// One row for each kind, in the order of FurtherState.
inline constexpr std::array<FurtherStateRow, kFurtherStateCount> kFurtherStates = {{
    {FurtherState::kClockOffset, "clock_offset", "Clock offset", "of the star tracker", Unit::kSecond,
     further_state_components::kClockOffset},
    {FurtherState::kClockRate, "clock_rate", "Clock rate", "of the star tracker, against that of the gyros",
     Unit::kSecondPerSecond, further_state_components::kClockRate},
    {FurtherState::kOrbitalError, "orbital_error", "Error at orbital period", "of each star tracker, at orbital period",
     Unit::kRadian, further_state_components::kOrbitalError},
    {FurtherState::kStarTrackerAlignment, "", "Alignment of a further star tracker", "", Unit::kRadian,
     further_state_components::kStarTrackerAlignment},
    {FurtherState::kReadoutBias, "readout_bias", "Bias of the direction cosines", "of the direction cosines",
     Unit::kRadian, further_state_components::kReadoutBias},
    {FurtherState::kCoefficientChange, "coefficient_change", "Change of the coefficients", "of eq. (1), over the pass",
     Unit::kRadianPerSecond, further_state_components::kCoefficientChange},
    {FurtherState::kOrbitalDrift, "orbital_drift", "Drift at orbital period", "about each case axis, at orbital period",
     Unit::kRadianPerSecond, further_state_components::kOrbitalDrift},
    {FurtherState::kPolhode, "polhode", "Change with the polhode", "of eq. (1), with the polhode of each rotor",
     Unit::kRadianPerSecond, further_state_components::kPolhode},
    {FurtherState::kWanderingDrift,
     "wandering_drift",
     "Drift that wanders",
     "about each case axis",
     Unit::kRadianPerSecond,
     {}},
}};

/// Its row in the table.
[[nodiscard]] constexpr const FurtherStateRow& row_of(FurtherState state) {
  return kFurtherStates[static_cast<std::size_t>(state)];
}

}  // namespace trihedron
