#pragma once

// Densities as histograms.

#include "polyest/types.h"

namespace polyest {

// The density of one quantity.
struct DensityEstimate {
  Vector value;    // centres of bins of equal width, in the quantity's unit
  Vector density;  // in each bin, in 1/unit
};

// The joint density of two quantities.
struct JointDensity {
  Vector first, second;  // bin centres, each in its quantity's unit
  Matrix density;        // first × second, in 1/(unit of the first · unit of the second)
};

}  // namespace polyest
