#pragma once

// The standard normal density cut to [a, b]; either bound may be infinite.
//   ρ(ξ) = φ(ξ)/Z on [a, b],  φ(ξ) = e^{−ξ²/2}/√(2π),  Z = ∫_a^b φ.
//
// Its orthogonal polynomials have no closed form (stieltjes.h). Their discrete measure has
// Gauss–Legendre nodes on panels of width ≤ 1, on each as many as the polynomials asked for and 20
// more. That leaves 40 degrees for the density, whose Chebyshev coefficients on a panel are below
// 10⁻¹⁶ of its size from degree 30 on wherever it is above 10⁻³⁰ of its maximum.

#include "core/chaos/germ.h"
#include "core/common/types.h"

namespace polyest::internal {

// Returns ∫_a^b φ, a ≤ b, with the relative error of rounding, also in the tails and for narrow
// intervals.
double NormalProbability(double a, double b);

// Returns the ξ in [a, b] with ∫_a^ξ φ = p Z, 0 < p ≤ ½. For the upper tail, negate the quantile of
// [−b, −a].
double TruncatedNormalQuantile(double a, double b, double p);

// Returns the first `count` coefficients, 1 ≤ count ≤ Germ::kMaxTruncatedNormalOrder + 1.
RecurrenceCoefficients TruncatedNormalRecurrence(double a, double b, int count);

}  // namespace polyest::internal
