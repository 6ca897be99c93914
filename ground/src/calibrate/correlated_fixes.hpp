#pragma once
/// Errors of a star tracker that are alike from one fix to the next, as behind a filter of its own.

#include <optional>
#include <vector>

#include "trihedron/records/pass.hpp"
#include "trihedron/records/run.hpp"

namespace trihedron::ground {

/// The star trackers whose fixes have such errors, by the gyros while the body turns evenly (docs/mathematics.md,
/// section 12). Not those whose errors stay alike for two minutes: with fixes far enough apart too few would be left of
/// the pass.
[[nodiscard]] std::vector<CorrelatedFixes> correlated_fixes(const Pass& pass);

/// Leaves out the fixes of these star trackers that come too soon after the last one that stays, and counts them.
void leave_out(std::vector<CorrelatedFixes>& correlated, Pass& pass);
/// The pass without them; nothing where there are no such star trackers.
[[nodiscard]] std::optional<Pass> without(std::vector<CorrelatedFixes>& correlated, const Pass& pass);

}  // namespace trihedron::ground
