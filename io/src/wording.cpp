#include "wording.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "trihedron/records/estimator.hpp"
#include "trihedron/records/text.hpp"

namespace trihedron::io {
std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

bool begins_as_json(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{';
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::size_t end = std::min(text.size(), kLongest);
  while (end < text.size() && end > kLongest - 4 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80) {
    --end;  // not within a character
  }
  return fmt::format("\"{}{}\"", printable(text.substr(0, end)), end < text.size() ? "..." : "");
}

std::string suggestion(std::string_view unknown, std::span<const std::string_view> known) {
  const std::string_view meant = nearest(unknown, known);
  return meant.empty() ? fmt::format("known here: {}", fmt::join(known, ", "))
                       : fmt::format("did you mean \"{}\"?", meant);
}

std::string outside(const Range& range) {
  return fmt::format("outside {}{:g} to {:g}{}{}", range.zero_allowed ? "0 and " : "", range.least, range.most,
                     range.unit.empty() ? "" : " ", range.unit);
}

std::string is_outside(double value, const Range& range) {
  return fmt::format("is {}{}{}, {}", value, range.unit.empty() ? "" : " ", range.unit, outside(range));
}

std::string estimator_choices() {
  std::string text;
  for (const EstimatorRow& row : kEstimators) {
    text += fmt::format("{}{}", text.empty() ? "" : ", ", row.name);
  }
  return text;
}

}  // namespace trihedron::io
