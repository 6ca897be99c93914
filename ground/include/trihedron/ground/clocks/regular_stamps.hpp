#pragma once
/// Stamps of gyro samples that scatter about the regular times at which they were taken.

#include <optional>
#include <vector>

#include "trihedron/records/pass.hpp"

namespace trihedron::ground {

/// Stamps that do not scatter.
struct RegularStamps {
  std::vector<Time> t;   ///< of each sample; as they were where there are too few in a row
  double scatter_s = 0;  ///< root mean square of how far the stamps are off
};

/// Where the directions go on more evenly by regular times than by the stamps: those times, by the mean of the stamps
/// some thousand samples around. Nothing where the stamps are regular, or as good as others: of a body that does not
/// turn, or of samples that were taken when their stamps say.
[[nodiscard]] std::optional<RegularStamps> regular_stamps(const Pass& pass);

}  // namespace trihedron::ground
