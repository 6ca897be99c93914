#include "trihedron/records/parameter_id.hpp"

#include <array>
#include <charconv>

namespace trihedron {
namespace {

using Kind = ParameterId::Kind;
using Owner = FurtherStateKind::Owner;

constexpr std::string_view kAlignment = "align_";
constexpr std::string_view kAxes = "xyz";
constexpr std::string_view kGyro = "gyro";
constexpr std::string_view kStarTracker = "star_tracker_";

/// What stands before the components of a further state.
std::string owner_name(Owner owner, std::size_t number) {
  switch (owner) {
    case Owner::kPass:
      return "";
    case Owner::kGyro:
      return std::string(kGyro) + std::to_string(number) + "_";
    case Owner::kStarTracker:
      if (number == 1) {
        return "";
      }
      break;
    case Owner::kFurtherStarTracker:
      break;
  }
  return std::string(kStarTracker) + std::to_string(number) + "_";
}

/// A number from 1 on after `prefix`, as an index, and what comes after it.
struct Numbered {
  std::size_t index = 0;
  std::string_view rest;
};
std::optional<Numbered> numbered(std::string_view name, std::string_view prefix) {
  constexpr std::size_t kMost = 255;
  if (!name.starts_with(prefix)) {
    return std::nullopt;
  }
  const std::string_view text = name.substr(prefix.size());
  std::size_t number = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (fault != std::errc() || number < 1 || number > kMost) {
    return std::nullopt;
  }
  return Numbered{number - 1, text.substr(static_cast<std::size_t>(end - text.data()))};
}

std::optional<ParameterId> of_gyro(std::size_t gyro, std::string_view name) {
  if (name.starts_with(kAlignment) && name.size() == kAlignment.size() + 1) {
    const std::size_t axis = kAxes.find(name.back());
    return axis == std::string_view::npos ? std::nullopt
                                          : std::optional(ParameterId::alignment(gyro, static_cast<int>(axis)));
  }
  const std::optional<DriftCoefficient> coefficient = drift_coefficient_named(name);
  return coefficient ? std::optional(ParameterId::drift(gyro, *coefficient)) : std::nullopt;
}

std::optional<ParameterId> further_named(std::string_view name) {
  const std::optional<Numbered> of_a_gyro = numbered(name, kGyro);
  const std::optional<Numbered> of_a_head = numbered(name, kStarTracker);
  for (const FurtherStateRow& row : kFurtherStates) {
    std::size_t owner = 0;
    std::string_view component = name;
    const Owner owned_by = kind_of(row.state).owner;
    const std::optional<Numbered>& found = owned_by == Owner::kGyro ? of_a_gyro : of_a_head;
    if (found && found->rest.starts_with('_') && owned_by != Owner::kPass) {
      owner = found->index;
      component = found->rest.substr(1);
    }
    if (owner_name(owned_by, owner + 1) + std::string(component) != name) {
      continue;
    }
    for (std::size_t i = 0; i < row.components.size(); ++i) {
      if (row.components[i] == component) {
        return ParameterId::further(row.state, owner, static_cast<int>(i));
      }
    }
  }
  return std::nullopt;
}

}  // namespace

std::vector<ParameterId> drift_and_alignment(const DriftModelId& model, std::size_t gyros) {
  std::vector<ParameterId> parameters;
  for (std::size_t gyro = 0; gyro < gyros; ++gyro) {
    for (const DriftCoefficient& coefficient : coefficients_of(model)) {
      parameters.push_back(ParameterId::drift(gyro, coefficient));
    }
    for (int axis = 0; axis < 3; ++axis) {
      parameters.push_back(ParameterId::alignment(gyro, axis));
    }
  }
  return parameters;
}

std::string short_name_of(const ParameterId& parameter) {
  switch (parameter.kind) {
    case Kind::kDrift:
      return name_of(parameter.coefficient);
    case Kind::kAlignment:
      return std::string(kAlignment) + kAxes[parameter.component];
    case Kind::kFurtherState:
      break;
  }
  return name_of(parameter);
}

std::string name_of(const ParameterId& parameter) {
  const std::size_t number = std::size_t{1} + parameter.owner;
  if (parameter.kind != Kind::kFurtherState) {
    return std::string(kGyro) + std::to_string(number) + "." + short_name_of(parameter);
  }
  const FurtherStateRow& row = row_of(parameter.further_state);
  const std::string component = parameter.component < row.components.size()
                                    ? std::string(row.components[parameter.component])
                                    : std::string(row.key) + "_" + std::to_string(parameter.component + 1);
  return owner_name(kind_of(row.state).owner, number) + component;
}

std::optional<ParameterId> parameter_named(std::string_view name) {
  const std::optional<Numbered> found = numbered(name, kGyro);
  return found && found->rest.starts_with('.') ? of_gyro(found->index, found->rest.substr(1)) : further_named(name);
}

}  // namespace trihedron
