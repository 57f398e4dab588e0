#pragma once

// The exponential density on [−1, 1],
//   ρ(ξ) = r e^{rξ}/(2 sinh r),  rate r > 0.
// It is that of the logarithm of a uniform variable, mapped to [−1, 1].
//
// Its orthogonal polynomials have no closed form (stieltjes.h). Their discrete measure has as many
// Gauss–Legendre nodes as the polynomials asked for and 20 more, which leaves 40 degrees for the
// density: its Legendre coefficients are below 10⁻¹⁶ of its size from degree 25 on if r ≤ 5.

#include "core/chaos/germ.h"

namespace polyest::internal {

// Returns log (r/(2 sinh r)).
double LogExponentialNormalization(double rate);

// Return the probabilities below and above ξ, which is moved into [−1, 1], and their inverses,
// accurate in both tails.
double ExponentialProbability(double rate, double xi);
double UpperExponentialProbability(double rate, double xi);
double ExponentialQuantile(double rate, double probability);
double UpperExponentialQuantile(double rate, double probability);

// Returns the first `count` ≥ 1 coefficients.
RecurrenceCoefficients ExponentialRecurrence(double rate, int count);

}  // namespace polyest::internal
