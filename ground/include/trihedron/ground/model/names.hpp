#pragma once
/// The names of estimators, drift models, and of what was done with samples, fixes and gyros.

#include <array>
#include <string>

#include "trihedron/core/status.hpp"

namespace trihedron::ground {

/// What `CalibrationOptions::estimator` and `drift_model` may name.
inline constexpr const char* kInvariant = "invariant";
inline constexpr const char* kPaper = "paper";
inline constexpr const char* kBatch = "batch";  ///< estimator invariant, and then least squares over the whole pass
inline constexpr std::array<const char*, 3> kEstimators = {kInvariant, kPaper, kBatch};
inline constexpr const char* kAutoDriftModel = "auto";
inline constexpr const char* kDriftModels = "auto, esg7, esg20, or vsh:1 … vsh:6, which are for estimator batch";
inline constexpr const char* kLargestDriftModel = "vsh:6";
[[nodiscard]] bool is_drift_model(const std::string& name);
/// Whether a drift model is of the batch alone. It has a smaller one beside it on board.
[[nodiscard]] inline bool is_for_whole_pass(const std::string& drift_model) { return drift_model.starts_with("vsh:"); }

[[nodiscard]] const char* name_of(FixStatus status);
[[nodiscard]] const char* name_of(SampleStatus status);
[[nodiscard]] const char* name_of(GyroState state);

}  // namespace trihedron::ground
