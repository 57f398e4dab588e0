#pragma once

// The recurrence of polynomials orthogonal by a density without a closed form, by Stieltjes'
// procedure on a discrete measure (W. Gautschi, Orthogonal Polynomials, Oxford 2004, §2.2).

#include "core/chaos/germ.h"
#include "core/common/types.h"

namespace polyest::internal {

// A discrete measure that integrates polynomials times the density: offsets ξ − start and weights
// of sum 1.
struct DiscreteMeasure {
  double start = 0;
  Eigen::ArrayXd offsets;
  Eigen::ArrayXd weights;
};

// Returns the first `count` ≥ 1 coefficients. The measure must integrate the squares of the
// polynomials of degree < `count`.
RecurrenceCoefficients StieltjesRecurrence(const DiscreteMeasure& measure, int count);

}  // namespace polyest::internal
