#include "trihedron/records/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "trihedron/records/scenario.hpp"

namespace trihedron {
namespace {

struct CodePoint {
  std::uint32_t value = 0;
  std::size_t bytes = 0;  ///< 0: the text does not begin with valid UTF-8
};

/// The first of a text that is not empty. RFC 3629: no overlong forms, no surrogates, up to U+10FFFF.
CodePoint first_code_point(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i])); };
  const std::uint32_t head = byte(0);
  if (head < 0x80) {
    return {head, 1};
  }
  const std::size_t bytes = head >= 0xF0 ? 4 : head >= 0xE0 ? 3 : 2;
  if (head < 0xC2 || head > 0xF4 || text.size() < bytes) {
    return {};
  }
  std::uint32_t value = head & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) {
      return {};
    }
    value = (value << 6U) | (byte(i) & 0x3FU);
  }
  constexpr std::array<std::uint32_t, 5> kLeast = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = value >= 0xD800 && value <= 0xDFFF;
  return value < kLeast[bytes] || value > 0x10FFFF || surrogate ? CodePoint{} : CodePoint{value, bytes};
}

/// Whether a terminal or a browser obeys it instead of showing it.
bool is_control(std::uint32_t c) {
  return c < 0x20 || (c >= 0x7F && c <= 0x9F) || c == 0x200E || c == 0x200F || (c >= 0x2028 && c <= 0x202E) ||
         (c >= 0x2066 && c <= 0x2069) || c == 0xFEFF;
}

std::string hexadecimal(std::uint32_t value) {
  std::array<char, 8> digits{};
  const auto written = std::to_chars(digits.data(), digits.data() + digits.size(), value, 16);
  const std::string text(digits.data(), written.ptr);
  return text.size() < 2 ? "0" + text : text;
}

/// Of a number that is not negative.
std::string with_leading_zeros(std::int64_t number, std::size_t digits) {
  std::string text = std::to_string(number);
  return std::string(digits - std::min(digits, text.size()), '0') + text;
}

std::string shown(std::string_view text, bool keep_line_ends) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const CodePoint c = first_code_point(text);
    if (c.bytes == 0) {
      out += "\\x" + hexadecimal(static_cast<unsigned char>(text.front()));
    } else if (is_control(c.value) && !(keep_line_ends && c.value == '\n')) {
      out += c.value < 0x80 ? "\\x" + hexadecimal(c.value) : "\\u{" + hexadecimal(c.value) + "}";
    } else {
      out += text.substr(0, c.bytes);
    }
    text.remove_prefix(std::max<std::size_t>(c.bytes, 1));
  }
  return out;
}

/// Levenshtein's: insertions, deletions and replacements between two words.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, replaced});
    }
  }
  return row.back();
}

}  // namespace

std::string printable(std::string_view text) { return shown(text, false); }

std::string printable_lines(std::string_view text) { return shown(text, true); }

std::string shell_word(std::string_view text) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_./,:=+@%-";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string_view::npos) {
    return std::string(text);
  }
  std::string word = "'";
  for (const char c : text) {
    word += c == '\'' ? R"('\'')" : std::string(1, c);
  }
  return word + "'";
}

std::string_view nearest(std::string_view unknown, std::span<const std::string_view> known) {
  // A longer name is not read as a mistake for any: the distance takes their product in time.
  constexpr std::size_t kLongest = 100;
  if (unknown.empty() || unknown.size() > kLongest) {
    return {};
  }
  const auto distance = [&](std::string_view name) {
    return name.starts_with(unknown) ? 0 : edit_distance(unknown, name);
  };
  const auto found = std::ranges::min_element(known, {}, distance);
  const bool near =
      found != known.end() && distance(*found) <= std::max<std::size_t>(2, std::max(unknown.size(), found->size()) / 2);
  return near ? *found : std::string_view();
}

std::string iso_time(Time t) {
  constexpr std::chrono::sys_days kTaiOrigin = std::chrono::year(1958) / 1 / 1;
  const Duration since_origin = t.time_since_epoch();
  const std::chrono::days whole_days = std::chrono::floor<std::chrono::days>(since_origin);
  const std::chrono::year_month_day date(kTaiOrigin + whole_days);
  const std::chrono::hh_mm_ss<Duration> clock(since_origin - whole_days);
  std::string text =
      with_leading_zeros(static_cast<int>(date.year()), 4) + '-' +
      with_leading_zeros(static_cast<unsigned>(date.month()), 2) + '-' +
      with_leading_zeros(static_cast<unsigned>(date.day()), 2) + 'T' + with_leading_zeros(clock.hours().count(), 2) +
      ':' + with_leading_zeros(clock.minutes().count(), 2) + ':' + with_leading_zeros(clock.seconds().count(), 2);
  if (clock.subseconds() != Duration::zero()) {
    text += '.' + with_leading_zeros(clock.subseconds().count(), 9);
  }
  return text;
}

AngleUnit unit_of_angle(double rad) {
  const double size = std::abs(rad);
  if (size >= 100 * kArcminute && std::isfinite(size)) {
    return {kDegree, "°"};
  }
  return size >= 100 * kArcsecond && std::isfinite(size) ? AngleUnit{kArcminute, "′"} : AngleUnit{kArcsecond, "″"};
}

AngleUnit unit_of_angles(std::span<const double> rad) {
  std::vector<double> sizes;
  for (const double value : rad) {
    if (value != 0 && std::isfinite(value)) {
      sizes.push_back(std::abs(value));
    }
  }
  if (sizes.empty()) {
    return unit_of_angle(0);
  }
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::ranges::nth_element(sizes, middle);
  return unit_of_angle(*middle);
}

std::string three_digits(double value) {
  const int decimals = value == 0 ? 2 : std::clamp(2 - static_cast<int>(std::floor(std::log10(std::abs(value)))), 0, 9);
  std::array<char, 400> digits{};  // the largest double has 309 before the point
  const auto written =
      std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::fixed, decimals);
  return {digits.data(), written.ptr};
}

std::string angle_text(double rad) {
  if (!std::isfinite(rad)) {
    return std::string(kNoNumber);
  }
  return angle_text(rad, unit_of_angle(rad));
}

std::string angle_text(double rad, AngleUnit unit) {
  return std::isfinite(rad) ? three_digits(rad / unit.rad) + unit.symbol : std::string(kNoEntry);
}

}  // namespace trihedron
