#pragma once
/// Where a pass jumps from one fix to the next.

#include <cstddef>
#include <vector>

#include "choose/trial.hpp"

namespace trihedron::ground {

struct Jump {
  Time before{}, after{};  ///< the fixes between which it is
};

struct Jumps {
  std::vector<Jump> jumps;  ///< two at most
  std::size_t among = 0;    ///< places that were looked at
};

/// Where the directions by the fixes jump against those by the gyros, of all or of one of them, by more than chance or
/// the noise of the trial makes of a minute before and a minute after. Drift does not do that: a mounting that slips
/// does, and what knocks a rotor or the axes of the star tracker aside. Derived in docs/mathematics.md, section 12.
[[nodiscard]] Jumps jumps_over(const Trial& trial);

}  // namespace trihedron::ground
