#pragma once
/// What drift that a smaller model leaves out still does where its coefficients and the alignments make up for it.

#include "model/left_out.hpp"
#include "onboard/screened_pass.hpp"

namespace trihedron::ground {

/// Random walk of the momenta, rad/√s per axis across each, that moves them as far as what the coefficients that are
/// kept and the alignments cannot make up for, along the path that the momenta of the pass take in their cases: of the
/// gyro that has the most, over the times for which a random walk stands, 10 min and more (docs/mathematics.md, section
/// 12).
[[nodiscard]] double left_out_walk_rad_sqrt_s(const LeftOut& left_out, const Calibration& all,
                                              const ScreenedPass& pass);

}  // namespace trihedron::ground
