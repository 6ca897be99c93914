#pragma once
/// Advice on slews, and whether simulated flights bear it out, for people and for programs.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "trihedron/plan/advise.hpp"
#include "trihedron/plan/confirm.hpp"

namespace trihedron::cli {

/// The slews as a part of a scenario file, and what is gained; or why there are none. `limits`: as they were given.
[[nodiscard]] std::string advice_text(const plan::Advice& advice, const plan::SlewLimits& limits);
[[nodiscard]] std::string confirmation_text(const plan::Confirmation& confirmation);
[[nodiscard]] nlohmann::ordered_json advice_json(const plan::Advice& advice, const plan::SlewLimits& limits,
                                                 const std::optional<plan::Confirmation>& confirmation);

}  // namespace trihedron::cli
