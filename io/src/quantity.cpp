#include "trihedron/io/quantity.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>

#include "trihedron/io/error.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

struct Unit {
  std::string_view name;
  double factor;  ///< of the unit that the program computes in
};

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kArcMinute = kDegree / 60;
constexpr double kArcSecond = kDegree / 3600;

// Largest first: formatting takes the first that fits.
constexpr std::array kDurations = {Unit{"d", 86400e9}, Unit{"h", 3600e9}, Unit{"min", 60e9}, Unit{"s", 1e9},
                                   Unit{"ms", 1e6},    Unit{"us", 1e3},   Unit{"ns", 1}};
constexpr std::array kAngles = {Unit{"deg", kDegree}, Unit{"arcmin", kArcMinute}, Unit{"arcsec", kArcSecond},
                                Unit{"rad", 1}};
constexpr std::array kRates = {Unit{"deg/h", kDegree / 3600}, Unit{"deg/s", kDegree}, Unit{"arcmin/s", kArcMinute},
                               Unit{"arcsec/s", kArcSecond},  Unit{"rad/s", 1},       Unit{"rad/h", 1.0 / 3600}};
constexpr std::array kRandomWalks = {Unit{"deg/h^0.5", kDegree / 60}, Unit{"deg/s^0.5", kDegree},
                                     Unit{"arcsec/s^0.5", kArcSecond}, Unit{"rad/s^0.5", 1}};

/// Description of the accepted texts, for the error message.
struct Kind {
  std::string_view name;
  std::span<const Unit> units;
  std::string_view example;
};

constexpr Kind kDuration{"a duration", kDurations, "90min"};
constexpr Kind kAngle{"an angle", kAngles, "5arcmin"};
constexpr Kind kRate{"a rate", kRates, "0.1deg/h"};
constexpr Kind kRandomWalk{"an angle random walk", kRandomWalks, "0.001deg/h^0.5"};

[[noreturn]] void refuse(std::string_view text, const Kind& kind, std::string_view reason) {
  std::string accepted;
  for (const Unit& unit : kind.units) {
    accepted += accepted.empty() ? "" : ", ";
    accepted += unit.name;
  }
  throw UsageError(fmt::format("{} is not {}: {}; accepted units: {} (for example {})", in_quotes(text), kind.name,
                               reason, accepted, kind.example));
}

struct Parsed {
  double number;
  std::string_view rest;
};

/// A finite number at the head of the text, and what follows it.
std::optional<Parsed> parse_head(std::string_view text) {
  double number = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (fault != std::errc() || !std::isfinite(number)) {
    return std::nullopt;
  }
  return Parsed{number, trimmed(text.substr(static_cast<std::size_t>(end - text.data())))};
}

double parse(std::string_view text, const Kind& kind) {
  const std::optional<Parsed> parsed = parse_head(trimmed(text));
  if (!parsed) {
    refuse(text, kind, "it does not begin with a finite number");
  }
  if (parsed->rest.empty()) {
    refuse(text, kind, "the unit is missing");
  }
  for (const Unit& unit : kind.units) {
    if (unit.name == parsed->rest) {
      const double value = parsed->number * unit.factor;
      if (!std::isfinite(value)) {
        refuse(text, kind, "it is too large");
      }
      return value;
    }
  }
  refuse(text, kind, fmt::format("unit {} is unknown", in_quotes(parsed->rest)));
}

/// The shortest text that parses back to the same bits; the last unit of each kind has factor 1 or fits always.
std::string format(double value, const Kind& kind) {
  std::string best;
  for (const Unit& unit : kind.units) {
    for (const int digits : {6, 15, 17}) {
      const double number = value / unit.factor;
      const std::string text = fmt::format("{:.{}g}{}", number, digits, unit.name);
      if (std::isfinite(number) && parse(text, kind) == value) {
        if (best.empty() || text.size() < best.size()) {
          best = text;
        }
        break;
      }
    }
  }
  return best;
}

}  // namespace

Duration parse_signed_duration(std::string_view text) {
  constexpr double kLimitNs = 9.2e18;
  const double ns = parse(text, kDuration);
  if (!(std::abs(ns) < kLimitNs)) {
    refuse(text, kDuration, "it is longer than 292 years");
  }
  const Duration duration(std::llround(ns));
  if (ns != 0 && duration == Duration::zero()) {
    refuse(text, kDuration, "it is shorter than a nanosecond");
  }
  return duration;
}

Duration parse_duration(std::string_view text) {
  const Duration duration = parse_signed_duration(text);
  if (duration < Duration::zero()) {
    refuse(text, kDuration, "it must not be negative");
  }
  return duration;
}

double parse_angle_rad(std::string_view text) { return parse(text, kAngle); }
double parse_rate_rad_s(std::string_view text) { return parse(text, kRate); }
double parse_random_walk_rad_sqrt_s(std::string_view text) { return parse(text, kRandomWalk); }

double within(const Range& range, double value, std::string_view text) {
  if (!range.holds(value)) {
    throw UsageError(fmt::format("{} {}: {}", in_quotes(text), is_outside(value, range), range.why));
  }
  return value;
}

Duration within(const Range& range, Duration value, std::string_view text) {
  static_cast<void>(within(range, to_seconds(value), text));
  return value;
}

double parse_number(std::string_view text) {
  const std::optional<Parsed> parsed = parse_head(trimmed(text));
  if (!parsed || !parsed->rest.empty()) {
    throw UsageError(fmt::format("{} is not a number: a finite number without a unit is accepted (for example 0.5)",
                                 in_quotes(text)));
  }
  return parsed->number;
}

std::string format_duration(Duration duration) {
  for (const Unit& unit : kDurations) {
    const auto ns = static_cast<std::int64_t>(unit.factor);
    if (duration.count() % ns == 0 && (duration.count() != 0 || unit.name == "s")) {
      return fmt::format("{}{}", duration.count() / ns, unit.name);
    }
  }
  return {};  // not reached: the last unit is 1 ns
}

std::string format_angle(double rad) { return format(rad, kAngle); }
std::string format_rate(double rad_s) { return format(rad_s, kRate); }
std::string format_random_walk(double rad_sqrt_s) { return format(rad_sqrt_s, kRandomWalk); }

}  // namespace trihedron::io
