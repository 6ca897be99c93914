#include "trihedron/records/drift_models.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "trihedron/core/drift.hpp"

namespace trihedron {
namespace {

using Family = DriftModelId::Family;
using Member = DriftCoefficient::Member;

constexpr std::array<DriftModelRow, 3> kDriftModels = {{
    {Family::kEsg7, "esg7", 0},
    {Family::kEsg20, "esg20", 0},
    {Family::kVsh, "vsh:", DriftModelId::kMaxDegree},
}};

constexpr std::string_view kCubeDName = "D(k0)";
/// W(4, 4) less its part in k0. Earlier calibrations have a coefficient "W(4,4)" of the whole of it, and are refused.
constexpr std::string_view kBesideK0Name = "W(4,4-k0)";
constexpr DriftCoefficient kBesideK0 = {Member::kW, 4, 4};
static_assert(BesideK0::is(kBesideK0));
/// As of DriftHarmonic.
constexpr int kLargestHarmonic = 20;

const DriftModelRow& row_of(Family family) { return kDriftModels[static_cast<std::size_t>(family)]; }

DriftCoefficient harmonic(Member member, int degree, int order) {
  return {member, static_cast<std::int8_t>(degree), static_cast<std::int8_t>(order)};
}

/// All of `text` as a number; nothing for anything else, "+1" and "01" among it.
std::optional<int> whole_number(std::string_view text) {
  int number = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_all = fault == std::errc() && end == text.data() + text.size();
  return is_all && std::to_string(number) == text ? std::optional(number) : std::nullopt;
}

}  // namespace

std::span<const DriftModelRow> drift_models() { return kDriftModels; }

std::string name_of(const DriftModelId& model) {
  const DriftModelRow& row = row_of(model.family);
  return std::string(row.name) + (row.largest_degree > 0 ? std::to_string(model.degree) : "");
}

std::optional<DriftModelId> drift_model_named(std::string_view name) {
  for (const DriftModelRow& row : kDriftModels) {
    if (row.largest_degree == 0 && name == row.name) {
      return DriftModelId{row.family, 0};
    }
    if (row.largest_degree > 0 && name.starts_with(row.name)) {
      const std::optional<int> degree = whole_number(name.substr(row.name.size()));
      if (degree && *degree >= 1 && *degree <= row.largest_degree) {
        return DriftModelId{row.family, static_cast<std::uint8_t>(*degree)};
      }
    }
  }
  return std::nullopt;
}

std::vector<std::string> drift_model_names() {
  std::vector<std::string> names;
  for (const DriftModelRow& row : kDriftModels) {
    if (row.largest_degree == 0) {
      names.emplace_back(row.name);
    }
    for (int degree = 1; degree <= row.largest_degree; ++degree) {
      names.push_back(std::string(row.name) + std::to_string(degree));
    }
  }
  return names;
}

std::string drift_model_choices() {
  std::string choices;
  for (const DriftModelRow& row : kDriftModels) {
    const std::string name(row.name);
    choices += choices.empty() ? "" : row.family == kDriftModels.back().family ? ", or " : ", ";
    choices += row.largest_degree == 0 ? name : name + "1 … " + name + std::to_string(row.largest_degree);
  }
  return choices;
}

std::vector<DriftCoefficient> coefficients_of(const DriftModelId& model) {
  const DriftModel table(model, {});
  std::vector<DriftCoefficient> coefficients;
  coefficients.reserve(static_cast<std::size_t>(table.size()));
  for (int i = 0; i < table.size(); ++i) {
    coefficients.push_back(table.member(i));
  }
  return coefficients;
}

std::string name_of(const DriftCoefficient& coefficient) {
  if (coefficient == kBesideK0) {
    return std::string(kBesideK0Name);
  }
  switch (coefficient.member) {
    case Member::kEq1:
      return Esg7::kNames.at(static_cast<std::size_t>(coefficient.degree));
    case Member::kCubeD:
      return std::string(kCubeDName);
    case Member::kW:
    case Member::kD:
      break;
  }
  return (coefficient.member == Member::kW ? "W(" : "D(") + std::to_string(coefficient.degree) + "," +
         std::to_string(coefficient.order) + ")";
}

std::optional<DriftCoefficient> drift_coefficient_named(std::string_view name) {
  const auto* const in_eq1 = std::ranges::find(Esg7::kNames, name);
  if (in_eq1 != Esg7::kNames.end()) {
    return DriftCoefficient::of_eq1(static_cast<int>(in_eq1 - Esg7::kNames.begin()));
  }
  if (name == kCubeDName) {
    return DriftCoefficient{Member::kCubeD, 0, 0};
  }
  if (name == kBesideK0Name) {
    return kBesideK0;
  }
  const bool is_w = name.starts_with("W(");
  const std::size_t comma = name.find(',');
  if ((!is_w && !name.starts_with("D(")) || comma == std::string_view::npos || !name.ends_with(')')) {
    return std::nullopt;
  }
  const std::optional<int> degree = whole_number(name.substr(2, comma - 2));
  const std::optional<int> order = whole_number(name.substr(comma + 1, name.size() - comma - 2));
  if (!degree || !order || *degree < 1 || *degree > kLargestHarmonic || *order < -*degree || *order > *degree) {
    return std::nullopt;
  }
  const DriftCoefficient named = harmonic(is_w ? Member::kW : Member::kD, *degree, *order);
  return named == kBesideK0 ? std::nullopt : std::optional(named);
}

std::vector<std::string> coefficient_names(const DriftModelId& model) {
  std::vector<std::string> names;
  for (const DriftCoefficient& coefficient : coefficients_of(model)) {
    names.push_back(name_of(coefficient));
  }
  return names;
}

}  // namespace trihedron
