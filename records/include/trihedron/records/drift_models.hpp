#pragma once
/// The drift models by name, and their coefficients. A coefficient is the same in each model that has it.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trihedron/core/drift_model.hpp"

namespace trihedron {

/// One family of drift models, as users name it.
struct DriftModelRow {
  DriftModelId::Family family;
  std::string_view name;  ///< in settings, in calibration.json and for people; the degree comes after it
  int largest_degree;     ///< 0 where the model has none
};

/// One row for each, in the order of DriftModelId::Family.
[[nodiscard]] std::span<const DriftModelRow> drift_models();

inline constexpr DriftModelId kLargestDriftModel = vsh(DriftModelId::kMaxDegree);

/// In settings in place of a name: the model that the pass gives evidence of.
inline constexpr std::string_view kAutoDriftModel = "auto";

/// In settings in place of a name: the drift field, all members of the largest model, those outside eq. (1) with
/// prior variances that the pass determines. May be asked for with estimator batch only.
inline constexpr std::string_view kDriftField = "field";

/// "esg7", "vsh:2"
[[nodiscard]] std::string name_of(const DriftModelId& model);
/// Nothing for another name, or a degree that there is not.
[[nodiscard]] std::optional<DriftModelId> drift_model_named(std::string_view name);
/// The names of all drift models.
[[nodiscard]] std::vector<std::string> drift_model_names();
/// For messages: "esg7, esg20, or vsh:1 … vsh:8"
[[nodiscard]] std::string drift_model_choices();

/// The coefficients of a model in the order of `drift_rad_s` in GyroCalibration; those of eq. (1) come first.
[[nodiscard]] std::vector<DriftCoefficient> coefficients_of(const DriftModelId& model);

/// "k0", "W(1,-1)"
[[nodiscard]] std::string name_of(const DriftCoefficient& coefficient);
/// Of degrees up to that of the simulator, 20; nothing for another name.
[[nodiscard]] std::optional<DriftCoefficient> drift_coefficient_named(std::string_view name);
/// In the model's order.
[[nodiscard]] std::vector<std::string> coefficient_names(const DriftModelId& model);

}  // namespace trihedron
