#include "unusable.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "quantity_kind.hpp"

namespace trihedron::io {
namespace {

constexpr double kTolerance = 1e-3;  // of a norm, as in the screening
constexpr double kMostOfRows = 0.9;  // of the rows must fit
constexpr std::size_t kMostRows = 1000;

std::vector<std::size_t> some_of(std::span<const std::size_t> rows) {
  std::vector<std::size_t> some;
  for (std::size_t i = 0; i < rows.size(); i += rows.size() / kMostRows + 1) {
    some.push_back(rows[i]);
  }
  return some;
}

/// Whether `norm_of(row)` is `expected` in most rows.
template <class NormOf>
bool is_norm(const std::vector<std::size_t>& rows, double expected, const NormOf& norm_of) {
  const auto fits = [&](std::size_t row) { return std::abs(norm_of(row) / expected - 1) <= kTolerance; };
  return !rows.empty() &&
         static_cast<double>(std::ranges::count_if(rows, fits)) >= kMostOfRows * static_cast<double>(rows.size());
}

/// The count that stands for 1, where all rows have the same norm.
template <class NormOf>
std::optional<double> counts_per_unit(const std::vector<std::size_t>& rows, const NormOf& norm_of) {
  std::vector<double> norms;
  for (const std::size_t row : rows) {
    if (const double norm = norm_of(row); std::isfinite(norm)) {
      norms.push_back(norm);
    }
  }
  if (norms.empty()) {
    return std::nullopt;
  }
  const auto middle = norms.begin() + static_cast<std::ptrdiff_t>(norms.size() / 2);
  std::ranges::nth_element(norms, middle);
  const double usual = *middle;
  return usual > 0 && is_norm(rows, usual, norm_of) ? std::optional(usual) : std::nullopt;
}

std::string cure_of_counts(double counts) {
  return fmt::format(
      "they all have the norm {0:g}: divide by it, or read them by a telemetry.toml with "
      "counts_per_unit = {0:.6g}",
      counts);
}

}  // namespace

std::string cure_of_directions(const Series& series, std::span<const std::size_t> rows, std::size_t gyro,
                               std::string otherwise) {
  const std::vector<std::size_t> some = some_of(rows);
  const auto value = [&](std::size_t row, std::size_t column) { return series.row(row)[column]; };
  const auto norm = [](double x, double y, double z) { return std::hypot(x, y, z); };
  const std::size_t first = 3 * gyro;
  const auto norm_of = [&](std::size_t row) {
    return norm(value(row, first), value(row, first + 1), value(row, first + 2));
  };
  std::vector<std::pair<std::size_t, std::size_t>> exchanged;
  for (std::size_t own = first; own < first + 3; ++own) {
    for (std::size_t other = 0; other < series.columns.size(); ++other) {
      const std::size_t others = other / 3 * 3;
      const auto mended = [&](std::size_t row, std::size_t begin) {
        std::array<double, 3> h{};
        for (std::size_t i = 0; i < 3; ++i) {
          const std::size_t column = begin + i;
          h[i] = value(row, column == own ? other : column == other ? own : column);
        }
        return norm(h[0], h[1], h[2]);
      };
      if (others != first && is_norm(some, 1, [&](std::size_t row) { return mended(row, first); }) &&
          is_norm(some, 1, [&](std::size_t row) { return mended(row, others); })) {
        exchanged.emplace_back(own, other);
      }
    }
  }
  if (exchanged.size() == 1) {
    return fmt::format("columns {} and {} look exchanged: all directions have length 1 with each in the other's place",
                       series.columns[exchanged.front().first], series.columns[exchanged.front().second]);
  }
  if (const std::optional<double> counts = counts_per_unit(some, norm_of)) {
    return cure_of_counts(*counts);
  }
  constexpr std::array kUnits = {std::pair{"deg", units::kDegree}, std::pair{"arcmin", units::kArcMinute},
                                 std::pair{"arcsec", units::kArcSecond}, std::pair{"mrad", 1e-3},
                                 std::pair{"rad", 1.0}};
  for (const auto& [name, unit] : kUnits) {
    const auto of_angles = [&, unit_rad = unit](std::size_t row) {
      return norm(std::cos(value(row, first) * unit_rad), std::cos(value(row, first + 1) * unit_rad),
                  std::cos(value(row, first + 2) * unit_rad));
    };
    if (is_norm(some, 1, of_angles)) {
      return fmt::format(
          "they look like angles from the axes: give their cosines, or read them by a telemetry.toml with "
          "unit = \"{}\"",
          name);
    }
  }
  return otherwise;
}

std::string cure_of_quaternions(const Series& series, std::span<const std::size_t> rows, std::string otherwise) {
  const auto norm_of = [&](std::size_t row) {
    const double* const q = series.row(row);
    return std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  };
  const std::optional<double> counts = counts_per_unit(some_of(rows), norm_of);
  return counts ? cure_of_counts(*counts) : std::move(otherwise);
}

}  // namespace trihedron::io
