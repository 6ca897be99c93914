#include "trihedron/io/quantity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>

#include "quantity_kind.hpp"
#include "trihedron/io/error.hpp"
#include "wording.hpp"

namespace trihedron::io {
namespace {

[[noreturn]] void refuse(std::string_view text, const QuantityKind& kind, std::string_view reason) {
  std::string accepted;
  for (const UnitOfMeasure& unit : kind.units) {
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

/// The shortest text that parses back to the same bits; the last unit of each kind has factor 1 or fits always.
std::string format(double value, const QuantityKind& kind) {
  std::string best;
  for (const UnitOfMeasure& unit : kind.units) {
    for (const int digits : {6, 15, 17}) {
      const double number = value / unit.factor;
      const std::string text = fmt::format("{:.{}g}{}", number, digits, unit.name);
      if (std::isfinite(number) && parse_quantity(text, kind) == value) {
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

namespace {

struct Measured {
  double value;  ///< in the unit that the program computes in
  const UnitOfMeasure& unit;
};

Measured measured(std::string_view text, const QuantityKind& kind) {
  const std::optional<Parsed> parsed = parse_head(trimmed(text));
  if (!parsed) {
    refuse(text, kind, "it does not begin with a finite number");
  }
  if (parsed->rest.empty()) {
    refuse(text, kind, "the unit is missing");
  }
  for (const UnitOfMeasure& unit : kind.units) {
    if (unit.name == parsed->rest) {
      const double value = parsed->number * unit.factor;
      if (!std::isfinite(value)) {
        refuse(text, kind, "it is too large");
      }
      return {value, unit};
    }
  }
  refuse(text, kind, fmt::format("unit {} is unknown", in_quotes(parsed->rest)));
}

/// The range in another unit, which is `factor` of its own: with ends that are in it as they are shown, of six digits.
Range in_unit(const Range& range, double factor, std::string_view unit) {
  constexpr double kDigits = 5;  // beside the first
  const auto inwards = [&](double end, double (*towards)(double)) {
    const double exact = end / factor;
    const double scale = exact == 0 ? 1 : std::pow(10, kDigits - std::floor(std::log10(std::abs(exact))));
    const double nearest = std::round(exact * scale) / scale;
    const bool is_in = nearest * factor >= range.least && nearest * factor <= range.most;
    return is_in || !std::isfinite(scale) ? nearest : towards(exact * scale) / scale;
  };
  Range shown = range;
  shown.least = inwards(range.least, [](double value) { return std::ceil(value); });
  shown.most = inwards(range.most, [](double value) { return std::floor(value); });
  shown.unit = unit;
  return shown;
}

[[noreturn]] void refuse_outside(std::string_view text, const Range& range) {
  throw UsageOutsideRange(fmt::format("{} is {}: {}", in_quotes(text), outside(range), range.why));
}

}  // namespace

bool is_unit(std::string_view name) {
  return std::ranges::any_of(kQuantityKinds, [name](const QuantityKind* kind) {
    return std::ranges::find(kind->units, name, &UnitOfMeasure::name) != kind->units.end();
  });
}

double parse_quantity(std::string_view text, const QuantityKind& kind) { return measured(text, kind).value; }

double parse_quantity(std::string_view text, const QuantityKind& kind, const Range& range) {
  const auto& [value, unit] = measured(text, kind);
  if (!range.holds(value / kind.range_factor)) {
    refuse_outside(text, in_unit(range, unit.factor / kind.range_factor, unit.name));
  }
  return value;
}

std::string pattern_of(const QuantityKind& kind) {
  std::string names;
  for (const UnitOfMeasure& unit : kind.units) {
    names += names.empty() ? "" : "|";
    for (const char c : unit.name) {
      names += c == '^' || c == '.' ? fmt::format("\\{}", c) : std::string(1, c);
    }
  }
  return fmt::format(R"(^[ \t]*-?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?[ \t]*({})[ \t]*$)", names);
}

Duration parse_signed_duration(std::string_view text) {
  constexpr double kLimitNs = 9.2e18;
  const double ns = parse_quantity(text, kDuration);
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

Duration parse_duration(std::string_view text, const Range& range_s) {
  const Duration duration = parse_duration(text);
  static_cast<void>(parse_quantity(text, kDuration, range_s));
  return duration;
}

Duration parse_signed_duration(std::string_view text, const Range& range_s) {
  const Duration duration = parse_signed_duration(text);
  static_cast<void>(parse_quantity(text, kDuration, range_s));
  return duration;
}

double parse_angle_rad(std::string_view text) { return parse_quantity(text, kAngle); }
double parse_angle_rad(std::string_view text, const Range& range) { return parse_quantity(text, kAngle, range); }
double parse_rate_rad_s(std::string_view text) { return parse_quantity(text, kRate); }
double parse_rate_rad_s(std::string_view text, const Range& range) { return parse_quantity(text, kRate, range); }
double parse_random_walk_rad_sqrt_s(std::string_view text) { return parse_quantity(text, kRandomWalk); }

Need parse_need(std::string_view text) {
  constexpr std::string_view kFor = " for ";
  const std::size_t at = text.find(kFor);
  if (at == std::string_view::npos) {
    throw UsageError(
        fmt::format("{} is not an accuracy that is needed: write an angle and how long it must be kept, "
                    "each with its unit (for example 5arcmin for 270min)",
                    in_quotes(text)));
  }
  const std::string_view error = text.substr(0, at);
  const std::string_view interval = text.substr(at + kFor.size());
  return {parse_angle_rad(error, limits::kNeededError_rad), parse_duration(interval, limits::kNeededInterval_s)};
}

double parse_number(std::string_view text) {
  const std::optional<Parsed> parsed = parse_head(trimmed(text));
  if (!parsed || !parsed->rest.empty()) {
    throw UsageError(fmt::format("{} is not a number: a finite number without a unit is accepted (for example 0.5)",
                                 in_quotes(text)));
  }
  return parsed->number;
}

double parse_number(std::string_view text, const Range& range) {
  const double number = parse_number(text);
  if (!range.holds(number)) {
    refuse_outside(text, range);
  }
  return number;
}

std::string format_need(const Need& need) {
  return format_angle(need.error_rad) + " for " + format_duration(need.interval);
}

std::string format_duration(Duration duration) {
  for (const UnitOfMeasure& unit : kDuration.units) {
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
