#pragma once

// A SUNDIALS vector over a block of trajectories, points × states, column by column.
//
// Debian compiles SUNDIALS without optimization, so the integration loop must not use SUNDIALS' own
// vector operations. All operations that CVODE uses are compiled here; the longest, the linear
// combination, reads memory once. The error norm is that of ErrorScale, in
// which the worst point of the block decides.

#include <sundials/sundials_nvector.h>

#include <Eigen/Core>

#include "core/propagation/error_scale.h"

namespace polyest::internal {

// Returns a vector of zeros, which N_VDestroy frees. `scale` defines the norm and must outlive the
// vector and its clones.
N_Vector NewBlockVector(Eigen::Index points, Eigen::Index states, ErrorScale* scale,
                        SUNContext context);

// Returns the vector's storage.
Eigen::ArrayXXd& BlockValues(N_Vector vector);

}  // namespace polyest::internal
