#pragma once

// Convergence diagnostics of Markov chains: split R̂ and the effective number of draws, for the bulk
// of the draws (A. Vehtari, A. Gelman, D. Simpson, B. Carpenter, P.-C. Bürkner,
// "Rank-normalization, folding, and localization: an improved R̂ for assessing convergence of MCMC",
// Bayesian Analysis 16 (2021)).
//
// The draws x_ts of one quantity, t = 0 … T − 1 along chain s, are first replaced by the normal
// scores of their ranks, Φ⁻¹((rank − 3/8)/(T C + 1/4)). The results then do not depend on a
// transformation of the quantity and exist for any tails.

#include "core/common/types.h"

namespace polyest::internal {

// Returns the normal scores (T × C) of the draws (T × C). Equal draws share the mean of their
// ranks.
Matrix RankNormalized(const ConstMatrixRef& draws);

// Returns the split R̂ of chains in G groups of C/G neighbouring columns, groups that never exchange
// anything: a group's draws of the first half of the times and those of the second half are 2G
// sequences of N draws each. With W the mean of their variances, B/N the variance of their means,
//   R̂ = √((N − 1)/N + (B/N)/W).
// It is 1 if nothing distinguishes the sequences or if the draws do not vary, and large if groups
// differ or drift. `groups` ≥ 2 must divide C; T ≥ 2.
double SplitRHat(const ConstMatrixRef& normalized, int groups);

// Returns the number of independent draws that would determine the mean equally well, T C/τ with
//   τ = 1 + 2 Σ_t ρ_t,   ρ_t = 1 − (W − mean autocovariance at lag t)/var⁺,
// var⁺ = (T − 1)/T W + B/T, W and B/T the variances within and between single chains, the sum over
// Geyer's initial monotone sequence. It is at most T C, and T C if the draws do not vary. T ≥ 4, C
// ≥ 2.
double EffectiveSize(const ConstMatrixRef& normalized);

}  // namespace polyest::internal
