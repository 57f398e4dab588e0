#pragma once

// The prior that a weight α² of the prior term stands for. exp(−α² J_apriori) = ρ(ξ)^{α²} is a
// density but for its integral, which depends on α² and is that of each germ apart:
//
//   Z(α²) = ∏ Z_i,  Z_i = ∫ ρ_i^{α²} dξ_i
//   normal            (2π)^{(1−α²)/2}/√α²                       N(0, 1/α²)
//   uniform           2^{1−α²}                                  the same uniform one: α² means
//                                                               nothing to it
//   beta(a, b)        c^{α²} 2^{a'+b'−1} B(a', b')              beta(a', b') with
//                                                               a' = 1 + α² (a − 1), b' likewise
//   gamma(s)          Γ(s)^{−α²} Γ(s')/(α²)^{s'}                gamma(s') ÷ α², s' = 1 + α² (s − 1)
//   truncated normal  (√(2π) P)^{−α²} √(2π/α²) P'               N(0, 1/α²) cut to the same bounds
//
// with c = 1/(2^{a+b−1} B(a, b)), P = ∫_a^b φ and P' = ∫ φ from √α² a to √α² b.

#include "core/chaos/germ.h"

namespace polyest {

// log Z_i. α² > 0.
double LogNormalization(const Germ& germ, double regularization);

// Variance of ρ_i^{α²}/Z_i; of a truncated normal an upper bound, the lesser of the normal's and of
// the uniform's between its bounds. α² > 0.
double WeightedVariance(const Germ& germ, double regularization);

// log Z_i as Laplace's approximation about the germ's mode has it, with a curvature of at least the
// inverse of WeightedVariance: exact for the normal one. α² > 0.
double LogLaplaceNormalization(const Germ& germ, double regularization);

}  // namespace polyest
