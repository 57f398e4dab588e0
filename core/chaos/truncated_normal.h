#pragma once

// The standard normal density cut to [a, b], either bound may be infinite:
//   ρ(ξ) = φ(ξ)/Z on [a, b],  φ(ξ) = e^{−ξ²/2}/√(2π),  Z = ∫_a^b φ.
//
// Its orthogonal polynomials have no closed form. Their recurrence is found by Stieltjes' procedure
// on a discrete measure (W. Gautschi, Orthogonal Polynomials, Oxford 2004, §2.2): Gauss–Legendre
// nodes on panels of width ≤ 1, as many on each as polynomials are asked for and 20 more, so that
// 40 degrees are left for the density, whose Chebyshev coefficients on a panel are below 10⁻¹⁶ of
// its size from degree 30 on wherever it is above 10⁻³⁰ of its maximum.

#include "core/chaos/germ.h"
#include "core/common/types.h"

namespace polyest {

// ∫_a^b φ, a ≤ b, to rounding relative to itself: in either tail and for narrow intervals too.
double NormalProbability(double a, double b);

// The ξ in [a, b] with ∫_a^ξ φ = p Z, 0 < p ≤ ½. Of an upper tail: −(that of [−b, −a]).
double TruncatedNormalQuantile(double a, double b, double p);

// 1 ≤ count ≤ Germ::kMostTruncatedNormalOrder + 1.
RecurrenceCoefficients TruncatedNormalRecurrence(double a, double b, int count);

}  // namespace polyest
