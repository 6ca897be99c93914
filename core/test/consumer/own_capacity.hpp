#pragma once
#include <trihedron/core/on_board.hpp>

inline constexpr trihedron::Layout kOwnLayout{.further = {.clock_offset = true}, .star_trackers = 2};
inline constexpr trihedron::Capacity kOwnCapacity = trihedron::Capacity::of(kOwnLayout);
using OwnOnBoard = trihedron::OnBoard<trihedron::InvariantEstimator<kOwnCapacity>>;
