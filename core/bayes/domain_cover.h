#pragma once

// Points that cover the part of a box of local coordinates that lies in Ω.
//
// A box moved to the posterior, or the prior's own with its overshoot, reaches beyond Ω. Of the
// points of a box that is 1.15 times as wide as Ω a fraction of 1.15⁻ⁿ lies in Ω: 0.5 % for n = 38,
// 0.01 % for n = 64. Points outside are therefore moved inside instead of being dropped.

#include "core/bayes/prior.h"
#include "core/bayes/region.h"
#include "core/common/types.h"

namespace polyest::internal {

// Returns `count` points (count × n) of the box lower ≤ η ≤ upper (n each) in local coordinates.
// Points outside of Ω are moved towards a point inside: the mean of those `guesses` (any number ×
// n, local coordinates) that lie in Ω and in the box, or else the box's middle moved into Ω. If
// that point lies in the box, all points lie in Ω and in the box.
Matrix CoverOfDomain(const Region& region, const Prior& prior, const Vector& lower,
                     const Vector& upper, const Matrix& guesses, int count);

// Returns the largest s ≤ 1 for which inside + s (ξ − inside) lies in Ω; `inside` must lie in Ω.
double FractionInDomain(const Prior& prior, const Vector& xi, const Vector& inside);

}  // namespace polyest::internal
