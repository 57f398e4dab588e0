#pragma once

// Whether Markov chains have converged, and what their draws are worth. A. Vehtari, A. Gelman,
// D. Simpson, B. Carpenter, P.-C. Bürkner, "Rank-normalization, folding, and localization: an
// improved R̂ for assessing convergence of MCMC", Bayesian Analysis 16 (2021), for the bulk of the
// draws.
//
// Draws x_ts of one quantity, t = 0 … T − 1 along chain s. They are first replaced by normal scores
// of their ranks, Φ⁻¹((rank − 3/8)/(T C + 1/4)), so that the results do not depend on how the
// quantity is measured and exist whatever its tails.

#include "core/common/types.h"

namespace polyest {

// draws is T × C; so is the result. Equal draws share the mean of their ranks.
Matrix RankNormalized(const ConstMatrixRef& draws);

// Split R̂ of chains in G groups of C/G neighbouring columns, groups that never exchange anything:
// a group's draws of the first half of the times and those of the second half are 2G sequences of
// N draws each, with W the mean of their variances and B/N the variance of their means,
//   R̂ = √((N − 1)/N + (B/N)/W).
// 1 when nothing distinguishes them, large when groups differ or drift. groups ≥ 2 divides C,
// T ≥ 2. 1 for draws that do not vary.
double SplitRHat(const ConstMatrixRef& normalized, int groups);

// The number of independent draws that would tell a mean as well, T C/τ with
//   τ = 1 + 2 Σ_t ρ_t,   ρ_t = 1 − (W − mean autocovariance at lag t)/var⁺,
// var⁺ = (T − 1)/T W + B/T, W and B/T the variances within and between single chains, the sum over
// Geyer's initial monotone sequence. At most T C. T ≥ 4, C ≥ 2. T C for draws that do not vary.
double EffectiveSize(const ConstMatrixRef& normalized);

}  // namespace polyest
