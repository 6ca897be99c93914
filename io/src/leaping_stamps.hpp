#pragma once
/// Stamps that leap while the readings go on.

#include <vector>

#include "series.hpp"
#include "trihedron/core/time.hpp"

namespace trihedron::io {

/// Of `rows` of directions, whose times `t` increase, those between two leaps of their stamps, by as much forward as
/// back, over which the readings go on by one period: packets that bear the time of another. `t` is by row of the
/// series. Told only where the body turns by more than the readings scatter, and of stretches of ten minutes at most:
/// what is off for longer is a clock that has stepped.
[[nodiscard]] std::vector<std::size_t> rows_of_another_time(const Series& series, const std::vector<std::size_t>& rows,
                                                            const std::vector<Time>& t, Duration period);

}  // namespace trihedron::io
