#pragma once
/// The estimators that a calibration can be made by.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace trihedron {

/// How a calibration is made.
enum class Estimator : std::uint8_t {
  kInvariant,
  kPaper,
  kBatch,  ///< kInvariant, and then least squares over the whole pass
};

/// An estimator and its name.
struct EstimatorRow {
  Estimator estimator;
  std::string_view name;  ///< in settings, in calibration.json and for people
};

inline constexpr std::array<EstimatorRow, 3> kEstimators = {
    {{Estimator::kInvariant, "invariant"}, {Estimator::kPaper, "paper"}, {Estimator::kBatch, "batch"}}};

/// Its name in the table.
[[nodiscard]] constexpr std::string_view name_of(Estimator estimator) {
  return std::ranges::find(kEstimators, estimator, &EstimatorRow::estimator)->name;
}

/// Nothing for another name.
[[nodiscard]] constexpr std::optional<Estimator> estimator_named(std::string_view name) {
  const auto* const row = std::ranges::find(kEstimators, name, &EstimatorRow::name);
  return row == kEstimators.end() ? std::nullopt : std::optional(row->estimator);
}

}  // namespace trihedron
