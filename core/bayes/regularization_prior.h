#pragma once

// The prior that belongs to a weight α² of the prior term: exp(−α² J_apriori) = ρ(ξ)^{α²}, divided
// by its integral, which depends on α² and is a product over the germs:
//
//   Z(α²) = ∏ Z_i,  Z_i = ∫ ρ_i^{α²} dξ_i
//   normal            (2π)^{(1−α²)/2}/√α²                       N(0, 1/α²)
//   uniform           2^{1−α²}                                  the same uniform one: α² means
//                                                               nothing to it
//   beta(a, b)        c^{α²} 2^{a'+b'−1} B(a', b')              beta(a', b') with
//                                                               a' = 1 + α² (a − 1), b' likewise
//   gamma(s)          Γ(s)^{−α²} Γ(s')/(α²)^{s'}                gamma(s') ÷ α², s' = 1 + α² (s − 1)
//   truncated normal  (√(2π) P)^{−α²} √(2π/α²) P'               N(0, 1/α²) cut to the same bounds
//   exponential(r)    (2 sinh(r)/r)^{−α²} 2 sinh(α² r)/(α² r)   exponential(α² r)
//
// with c = 1/(2^{a+b−1} B(a, b)), P = ∫_a^b φ and P' = ∫ φ from √α² a to √α² b.

#include "core/chaos/germ.h"

namespace polyest::internal {

// Returns log Z_i; α² > 0.
double LogNormalization(const Germ& germ, double regularization);

// Returns the variance of ρ_i^{α²}/Z_i, α² > 0; for a truncated normal and an exponential an upper
// bound, the smaller of the variances of the density without bounds and of the uniform one between
// them.
double WeightedVariance(const Germ& germ, double regularization);

// Returns Laplace's approximation of log Z_i about the germ's mode, α² > 0, with a curvature of at
// least the inverse of WeightedVariance. It is exact for a normal germ.
double LogLaplaceNormalization(const Germ& germ, double regularization);

}  // namespace polyest::internal
