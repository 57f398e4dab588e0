#pragma once

// The Gauss quadrature rule of a germ's density,
//   ∫ f(ξ) ρ(ξ) dξ ≈ Σ_i w_i f(ξ_i),  exact for polynomials up to degree 2·count − 1,
// by Golub and Welsch (1969): nodes are the eigenvalues of the symmetric tridiagonal matrix with
// diagonal a_k and off-diagonal √b_k, weights the squared first components of its eigenvectors.

#include "core/chaos/germ.h"
#include "core/common/types.h"

namespace polyest {

struct GaussRule {
  Vector nodes;    // ascending, inside the support
  Vector weights;  // positive, of sum 1
};

// count ≥ 1.
GaussRule MakeGaussRule(const Germ& germ, int count);

}  // namespace polyest
