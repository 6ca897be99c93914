#pragma once
/// The kinds of quantities that texts with a unit give, one table of units each: readers and schemas go by them.

#include <array>
#include <numbers>
#include <span>
#include <string>
#include <string_view>

#include "trihedron/records/limits.hpp"

namespace trihedron::io {

struct UnitOfMeasure {
  std::string_view name;
  double factor;  ///< of the unit that the program computes in
};

struct QuantityKind {
  std::string_view name;  ///< "an angle"
  std::span<const UnitOfMeasure> units;
  std::string_view example;
  Range range;  ///< where nothing narrower is told
  /// Of the unit of the range to that which the program computes in: durations are in nanoseconds, their ranges in
  /// seconds.
  double range_factor = 1;
};

namespace units {

inline constexpr double kDegree = std::numbers::pi / 180;
inline constexpr double kArcMinute = kDegree / 60;
inline constexpr double kArcSecond = kDegree / 3600;

// Largest first: formatting takes the first that fits.
inline constexpr std::array kDurations = {
    UnitOfMeasure{"d", 86400e9}, UnitOfMeasure{"h", 3600e9}, UnitOfMeasure{"min", 60e9}, UnitOfMeasure{"s", 1e9},
    UnitOfMeasure{"ms", 1e6},    UnitOfMeasure{"us", 1e3},   UnitOfMeasure{"ns", 1}};
inline constexpr std::array kAngles = {UnitOfMeasure{"deg", kDegree}, UnitOfMeasure{"arcmin", kArcMinute},
                                       UnitOfMeasure{"arcsec", kArcSecond}, UnitOfMeasure{"rad", 1}};
inline constexpr std::array kRates = {
    UnitOfMeasure{"deg/h", kDegree / 3600}, UnitOfMeasure{"deg/s", kDegree}, UnitOfMeasure{"arcmin/s", kArcMinute},
    UnitOfMeasure{"arcsec/s", kArcSecond},  UnitOfMeasure{"rad/s", 1},       UnitOfMeasure{"rad/h", 1.0 / 3600}};
inline constexpr std::array kRandomWalks = {UnitOfMeasure{"deg/h^0.5", kDegree / 60},
                                            UnitOfMeasure{"deg/s^0.5", kDegree},
                                            UnitOfMeasure{"arcsec/s^0.5", kArcSecond}, UnitOfMeasure{"rad/s^0.5", 1}};
inline constexpr std::array kLengths = {UnitOfMeasure{"km", 1e3}, UnitOfMeasure{"m", 1}};
inline constexpr std::array kFrequencies = {UnitOfMeasure{"Hz", 1}};
inline constexpr std::array kAccelerations = {UnitOfMeasure{"deg/s^2", kDegree}, UnitOfMeasure{"rad/s^2", 1}};
inline constexpr std::array kRateWalks = {UnitOfMeasure{"deg/h/s^0.5", kDegree / 3600},
                                          UnitOfMeasure{"rad/s/s^0.5", 1}};

}  // namespace units

inline constexpr QuantityKind kDuration{"a duration", units::kDurations, "90min", limits::kInterval_s, 1e9};  ///< ns
inline constexpr QuantityKind kAngle{"an angle", units::kAngles, "5arcmin", limits::kAngle_rad};              ///< rad
inline constexpr QuantityKind kRate{"a rate", units::kRates, "0.1deg/h", limits::kRate_rad_s};                ///< rad/s
inline constexpr QuantityKind kRandomWalk{"an angle random walk", units::kRandomWalks, "0.001deg/h^0.5",
                                          limits::kScenarioRandomWalk_rad_sqrt_s};               ///< rad/√s
inline constexpr QuantityKind kLength{"a length", units::kLengths, "360km", limits::kLength_m};  ///< m
inline constexpr QuantityKind kFrequency{"a frequency", units::kFrequencies, "0.02Hz", limits::kFrequency_hz};  ///< Hz
inline constexpr QuantityKind kAcceleration{"an angular acceleration", units::kAccelerations, "0.02deg/s^2",
                                            limits::kAcceleration_rad_s2};  ///< rad/s²
inline constexpr QuantityKind kRateWalk{"a random walk of a rate", units::kRateWalks, "1e-9rad/s/s^0.5",
                                        limits::kRateWalk_rad_s_sqrt_s};  ///< rad/s/√s

/// All of them: by their units numbers are told from words.
inline constexpr std::array kQuantityKinds = {&kDuration, &kAngle,     &kRate,         &kRandomWalk,
                                              &kLength,   &kFrequency, &kAcceleration, &kRateWalk};

/// Of some kind.
[[nodiscard]] bool is_unit(std::string_view name);

/// The value of a text, in the unit of the kind. Throws UsageError that names what is accepted.
[[nodiscard]] double parse_quantity(std::string_view text, const QuantityKind& kind);
/// Same, within a range, which the UsageError tells in the unit of the text.
[[nodiscard]] double parse_quantity(std::string_view text, const QuantityKind& kind, const Range& range);

/// Regular expression (ECMA) of the texts that parse_quantity() takes.
[[nodiscard]] std::string pattern_of(const QuantityKind& kind);

}  // namespace trihedron::io
