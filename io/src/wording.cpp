#include "wording.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "trihedron/records/estimator.hpp"

namespace trihedron::io {
namespace {

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

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string shown(text.substr(0, kLongest));
  std::ranges::replace_if(
      shown, [](char c) { return c < ' ' || c > '~'; }, '?');
  return fmt::format("\"{}{}\"", shown, text.size() > kLongest ? "..." : "");
}

std::string suggestion(std::string_view unknown, std::span<const std::string_view> known) {
  const auto distance = [&](std::string_view name) {
    return !unknown.empty() && name.starts_with(unknown) ? 0 : edit_distance(unknown, name);
  };
  const auto nearest = std::ranges::min_element(known, {}, distance);
  if (nearest == known.end() ||
      distance(*nearest) > std::max<std::size_t>(2, std::max(unknown.size(), nearest->size()) / 2)) {
    return fmt::format("known here: {}", fmt::join(known, ", "));
  }
  return fmt::format("did you mean \"{}\"?", *nearest);
}

std::string is_outside(double value, const Range& range) {
  const std::string unit = range.unit.empty() ? "" : fmt::format(" {}", range.unit);
  return fmt::format("is {}{}, outside {}{:g} to {:g}{}", value, unit, range.zero_allowed ? "0 and " : "",
                     range.least, range.most, unit);
}

std::string estimator_choices() {
  std::string text;
  for (const EstimatorRow& row : kEstimators) {
    text += fmt::format("{}{}", text.empty() ? "" : ", ", row.name);
  }
  return text;
}

}  // namespace trihedron::io
