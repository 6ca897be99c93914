#pragma once
/// Which parameter of a calibration is meant.

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/records/drift_models.hpp"
#include "trihedron/records/further_state.hpp"

namespace trihedron {

/// A drift coefficient or an alignment of a gyro, or a component of a further state.
struct ParameterId {
  enum class Kind : std::uint8_t { kDrift, kAlignment, kFurtherState };

  Kind kind = Kind::kDrift;
  /// Of a gyro from 0. Of a further star tracker from 1: 0 is the first, whose axes are c. 0 for a further state of the
  /// pass.
  std::uint8_t owner = 0;
  DriftCoefficient coefficient{};                           ///< of kDrift
  std::uint8_t component = 0;                               ///< axis of kAlignment, component of kFurtherState; from 0
  FurtherState further_state = FurtherState::kClockOffset;  ///< of kFurtherState

  friend constexpr auto operator<=>(const ParameterId& a, const ParameterId& b) = default;

  [[nodiscard]] static constexpr ParameterId drift(std::size_t gyro, DriftCoefficient coefficient) {
    return {Kind::kDrift, static_cast<std::uint8_t>(gyro), coefficient, 0, {}};
  }
  /// About axis x, y or z of c: 0 … 2.
  [[nodiscard]] static constexpr ParameterId alignment(std::size_t gyro, int axis) {
    return {Kind::kAlignment, static_cast<std::uint8_t>(gyro), {}, static_cast<std::uint8_t>(axis), {}};
  }
  [[nodiscard]] static constexpr ParameterId further(FurtherState state, std::size_t owner, int component) {
    return {Kind::kFurtherState, static_cast<std::uint8_t>(owner), {}, static_cast<std::uint8_t>(component), state};
  }

  [[nodiscard]] constexpr bool is_drift() const { return kind == Kind::kDrift; }
  [[nodiscard]] constexpr bool is_alignment() const { return kind == Kind::kAlignment; }
  [[nodiscard]] constexpr bool is_further(FurtherState state) const {
    return kind == Kind::kFurtherState && further_state == state;
  }
  /// Index of the gyro that it is a drift coefficient or an alignment of.
  [[nodiscard]] constexpr std::size_t gyro() const { return owner; }
  [[nodiscard]] constexpr Unit unit() const {
    return kind == Kind::kDrift       ? Unit::kRadianPerSecond
           : kind == Kind::kAlignment ? Unit::kRadian
                                      : row_of(further_state).unit;
  }
};

/// The drift coefficients and alignments of this number of gyros, gyro by gyro: the rows of a covariance in
/// calibration.json.
[[nodiscard]] std::vector<ParameterId> drift_and_alignment(const DriftModelId& model, std::size_t gyros);

/// As in calibration.json: "gyro1.k0", "gyro2.align_x", "clock_offset_s", "star_tracker_2_align_x_rad".
[[nodiscard]] std::string name_of(const ParameterId& parameter);
/// Without what it belongs to: "k0", "align_x"; of a further state as name_of().
[[nodiscard]] std::string short_name_of(const ParameterId& parameter);
/// Nothing for a name that is not of any parameter.
[[nodiscard]] std::optional<ParameterId> parameter_named(std::string_view name);

}  // namespace trihedron
