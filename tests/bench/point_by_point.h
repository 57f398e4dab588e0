#pragma once

// Propagates the half car as a program without ensembles does: by CVODE with SUNDIALS' serial
// vectors, one trajectory after the other.

#include "core/common/types.h"

namespace polyest::internal::bench {

// Adams formulas with functional iteration, or BDF with Newton's iteration and a dense Jacobian.
enum class Formula { kAdams, kBdf };
// Propagates all points from `parameters`, points × 2. Fills `outputs`, points × (4 · samples) at
// 100 Hz.
void PropagatePointByPoint(Formula formula, double relative_tolerance, const Matrix& parameters,
                           int samples, Matrix& outputs);

}  // namespace polyest::internal::bench
