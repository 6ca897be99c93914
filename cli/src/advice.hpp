#pragma once
/// Advice on slews, and whether simulated flights bear it out, for people and for programs.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "trihedron/plan/advise.hpp"
#include "trihedron/plan/confirm.hpp"

namespace trihedron::cli {

/// The slews as a part of a scenario file, and what is gained.
[[nodiscard]] std::string advice_text(const plan::Advice& advice);
[[nodiscard]] std::string confirmation_text(const plan::Confirmation& confirmation);
[[nodiscard]] nlohmann::ordered_json advice_json(const plan::Advice& advice,
                                                 const std::optional<plan::Confirmation>& confirmation);

}  // namespace trihedron::cli
