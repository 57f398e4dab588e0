#pragma once

// A SUNDIALS vector over a block of trajectories, points × states, column by column.
//
// Debian compiles SUNDIALS without optimization, so its own vector operations must stay out of the
// integration loop: all the operations that ERKStep and CVODE use are compiled here, and the
// longest, the linear combination of stages, goes through memory once. The error norm is that of
// ErrorScale, in which the worst point of the block decides.

#include <sundials/sundials_nvector.h>

#include <Eigen/Core>

#include "core/propagation/error_scale.h"

namespace polyest {

// A vector of zeros; N_VDestroy frees it. `scale` gives the norm and must outlive the vector and
// its clones.
N_Vector NewEnsembleVector(Eigen::Index points, Eigen::Index states, ErrorScale* scale,
                           SUNContext context);

// The vector's own storage.
Eigen::ArrayXXd& EnsembleValues(N_Vector vector);

}  // namespace polyest
