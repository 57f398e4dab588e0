#pragma once

// The Gauss quadrature rule of a germ's density,
//   ∫ f(ξ) ρ(ξ) dξ ≈ Σ_i w_i f(ξ_i),  exact for polynomials up to degree 2·count − 1,
// by Golub and Welsch (1969): the nodes are the eigenvalues of the symmetric tridiagonal matrix
// with diagonal a_k and off-diagonal √b_k; the weights are the squared first components of its
// eigenvectors.

#include "core/chaos/germ.h"
#include "core/common/types.h"

namespace polyest::internal {

struct GaussRule {
  Vector nodes;    // ascending, inside the support
  Vector weights;  // positive; their sum is 1
};

// Returns the rule with `count` ≥ 1 nodes.
GaussRule MakeGaussRule(const Germ& germ, int count);

}  // namespace polyest::internal
