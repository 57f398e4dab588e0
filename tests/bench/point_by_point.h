#pragma once

// What a program without ensembles does: CVODE with SUNDIALS' serial vectors, one trajectory after
// the other.

#include "core/common/types.h"

namespace polyest::internal::bench {

// Adams with functional iteration, or BDF with Newton's iteration and a dense Jacobian. Outputs are
// points × (4 · samples) at 100 Hz.
enum class Formula { kAdams, kBdf };
void PropagatePointByPoint(Formula formula, double relative_tolerance, const Matrix& parameters,
                           int samples, Matrix& outputs);

}  // namespace polyest::internal::bench
