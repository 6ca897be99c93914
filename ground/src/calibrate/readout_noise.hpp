#pragma once
/// Noise of the gyro readings, by the readings themselves.

#include <optional>

#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// Where the noise of a gyro is another than the settings tell, or in some hour or in slews another than in most of the
/// pass: that of all gyros, by third differences of their readings, to which no turn of a body adds; in slews by sixth
/// differences of the angles between the momenta. What shakes the body moves all readings alike, and is no noise of
/// theirs. Of readings up to half a second apart those that show most count: noise that has passed a filter is small
/// between neighbours. Where readings that are fitted together show more, it lasts longer, and counts as white noise
/// that shows as much there (docs/mathematics.md, section 12). Nothing of samples more than a second apart, or of few.
[[nodiscard]] std::optional<ReadoutNoise> other_readout_noise(const Pass& pass);

/// The pass with settings that tell this noise.
[[nodiscard]] Pass with(const ReadoutNoise& noise, Pass pass);

}  // namespace trihedron::ground
