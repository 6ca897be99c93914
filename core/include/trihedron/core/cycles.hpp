#pragma once
/// The cycles that are built: include this, and they need not be compiled again. Another one is one line here, one
/// where its estimator is declared, and one source like invariant_estimator_pair.cpp.

#include "trihedron/core/cycle.hpp"
#include "trihedron/core/invariant_estimator.hpp"
#include "trihedron/core/paper_estimator.hpp"

namespace trihedron {

extern template class Cycle<PaperEstimator<Esg7>>;
extern template class Cycle<InvariantEstimator<Esg7, 2>>;
extern template class Cycle<InvariantEstimator<Esg7, 2, kAllFurtherStates>>;
extern template class Cycle<InvariantEstimator<Esg20, 2, kAllFurtherStates>>;
extern template class Cycle<InvariantEstimator<Esg7, 3>>;
extern template class Cycle<InvariantEstimator<Esg7, 4>>;

}  // namespace trihedron
