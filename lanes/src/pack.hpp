#pragma once
/// Up to eight flights side by side.

#include <optional>
#include <span>
#include <vector>

#include "kernels.hpp"
#include "lane.hpp"

namespace trihedron::lanes {

/// Flies lanes that are all alike, kWidth of them at most. Nothing for one that has to be flown alone.
[[nodiscard]] std::vector<std::optional<FilterResult>> fly_pack(std::span<Lane* const> lanes, const Kernels& kernels);

}  // namespace trihedron::lanes
