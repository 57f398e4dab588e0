#pragma once

// How far residuals contradict the noise that the problem states.
//
// Residuals far larger than the stated noise make every sample count too much: the posterior
// becomes narrower than anything the model can explain, wanders from sample to sample by many of
// its standard deviations, and asks for an expansion that follows the model more closely than the
// model follows the rig. Either the estimate is not at the cost's minimum, which an expansion that
// has moved to a wrong place shows first in this way, or model or noise are wrong. In both cases
// the cost is divided by the ratio of the residuals' mean square to the noise's. This leaves the
// minimum of the mismatch where it is and widens the posterior to what the residuals allow. The
// classical name of the ratio is the reduced χ².

#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// What the residuals say at the minimum of the cost on the expansion, with the noise as stated and
// α² ≤ 1.
struct MisfitFound {
  // χ²/N if it is larger than 1 by at least six standard deviations, else 1. Channels whose noise
  // is learned or may have outliers do not count.
  double ratio = 1;
  // Whether the minimum lies at an edge of the expansion's region that is no edge of Ω. Residuals
  // there are no reason to doubt the noise before the region has moved on.
  bool at_edge = false;
};
MisfitFound FindMisfit(const ResolvedProblem& problem, const RegionalExpansion& expansion,
                       const Stop& stop);

}  // namespace polyest::internal
