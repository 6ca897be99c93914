#include "trihedron/records/statistics.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <variant>

namespace trihedron {
namespace {

using Field = std::variant<long Statistics::*, double Statistics::*, std::optional<long> Statistics::*,
                           std::optional<int> Statistics::*, std::optional<bool> Statistics::*,
                           std::optional<double> Statistics::*>;

struct Row {
  std::string_view name;
  Field field;
};

constexpr std::array<Row, 14> kRows = {{
    {"angle_looks", &Statistics::angle_looks},
    {"batch_converged", &Statistics::batch_converged},
    {"batch_iterations", &Statistics::batch_iterations},
    {"fixes", &Statistics::fixes},
    {"fixes_frozen", &Statistics::fixes_frozen},
    {"fixes_off_in_a_row", &Statistics::fixes_off_in_a_row},
    {"fixes_rejected_as_outliers", &Statistics::fixes_rejected_as_outliers},
    {"fixes_used", &Statistics::fixes_used},
    {"halves_chi_square", &Statistics::halves_chi_square},
    {"halves_degrees_of_freedom", &Statistics::halves_degrees_of_freedom},
    {"nis_count", &Statistics::nis_count},
    {"nis_degrees_of_freedom", &Statistics::nis_degrees_of_freedom},
    {"nis_mean", &Statistics::nis_mean},
    {"reopened", &Statistics::reopened},
}};

constexpr std::string_view kInnovation = "innovation_";
constexpr std::string_view kRms = "_rms_rad";

/// More components than any number of gyros has.
constexpr std::size_t kMostInnovations = 100;

template <class T>
struct Assign {
  static void to(T& field, double value) {
    // Beyond these a count is not one, and would not fit.
    constexpr double kMost = 2e9;
    if (std::abs(value) <= kMost) {
      field = static_cast<T>(std::llround(value));
    }
  }
};
template <>
struct Assign<double> {
  static void to(double& field, double value) { field = value; }
};
template <>
struct Assign<bool> {
  static void to(bool& field, double value) { field = value != 0; }
};
template <class T>
struct Assign<std::optional<T>> {
  static void to(std::optional<T>& field, double value) {
    if (std::is_same_v<T, double> || !std::isnan(value)) {
      Assign<T>::to(field.emplace(), value);
    }
  }
};

/// From 1 on: the number between kInnovation and kRms.
std::optional<std::size_t> innovation_number(std::string_view name) {
  if (!name.starts_with(kInnovation) || !name.ends_with(kRms)) {
    return std::nullopt;
  }
  const std::string_view text = name.substr(kInnovation.size(), name.size() - kInnovation.size() - kRms.size());
  std::size_t number = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_number = fault == std::errc() && end == text.data() + text.size();
  return is_number && number >= 1 && number <= kMostInnovations ? std::optional(number) : std::nullopt;
}

std::optional<double> value_in(const Statistics& statistics, const Field& field) {
  return std::visit(
      [&](auto member) {
        const auto& value = statistics.*member;
        if constexpr (requires { value.has_value(); }) {
          return value ? std::optional(static_cast<double>(*value)) : std::nullopt;
        } else {
          return std::optional(static_cast<double>(value));
        }
      },
      field);
}

}  // namespace

std::vector<std::pair<std::string, double>> named_values(const Statistics& statistics) {
  std::vector<std::pair<std::string, double>> values;
  for (const Row& row : kRows) {
    if (const std::optional<double> value = value_in(statistics, row.field)) {
      values.emplace_back(row.name, *value);
    }
  }
  for (std::size_t i = 0; i < statistics.innovation_rms_rad.size(); ++i) {
    values.emplace_back(std::string(kInnovation) + std::to_string(i + 1) + std::string(kRms),
                        statistics.innovation_rms_rad[i]);
  }
  std::ranges::sort(values, {}, [](const auto& value) -> const std::string& { return value.first; });
  return values;
}

void set_value(Statistics& statistics, std::string_view name, double value) {
  const auto* const row = std::ranges::find(kRows, name, &Row::name);
  if (row != kRows.end()) {
    std::visit(
        [&](auto member) {
          Assign<std::remove_reference_t<decltype(statistics.*member)>>::to(statistics.*member, value);
        },
        row->field);
  } else if (const std::optional<std::size_t> number = innovation_number(name)) {
    std::vector<double>& rms_rad = statistics.innovation_rms_rad;
    rms_rad.resize(std::max(rms_rad.size(), *number), std::nan(""));
    rms_rad[*number - 1] = value;
  }
}

}  // namespace trihedron
