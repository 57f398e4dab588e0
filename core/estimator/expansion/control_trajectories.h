#pragma once

// Control trajectories: what the error of integration does to an estimate.
//
// All trajectories of an expansion are integrated with the same tolerance, check points included,
// so an error that they have in common is invisible to their comparison. Over many periods it moves
// the estimate. So some check points are integrated once more, with a tenth of the tolerance. Let
// δ_k be the difference of the two outputs at the k-th sample. To first order, the outputs without
// error of integration are those of the expansion plus δ_k, which changes the gradient of a
// channel's ½ χ² (mismatch_sums.h) with respect to η by
//
//   s = ∂φᵀ Σ c_k δ_k/R_k.
//
// The minimum of the cost with Hessian H moves by −H⁻¹ s, and by
//
//   shift = √(sᵀ H⁻¹ s)
//
// standard deviations in the direction where these are most. Both s and H are taken at the check
// point itself, because δ_k oscillates with the trajectory that it belongs to; H is the
// Gauss–Newton matrix with the precision of the prior, so that it is positive definite.
//
// There are none where there is no such error or no other tolerance: with linear models that step
// exactly, models without states, models that simulate themselves (FMUs), and tolerances too close
// to the least one.

#include "core/bayes/cost.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// The tolerance of control trajectories ÷ that of the others.
inline constexpr double kControlTolerance = 0.1;
// Integrators support no smaller relative tolerance (IntegrationOptions).
inline constexpr double kMinControlTolerance = 1e-13;

// Returns by how many standard deviations the error of integration may move the estimate: the
// largest shift over the check points that have a weight in the posterior (AgreementWithModel). 0
// without control trajectories. `cost` is the cost on the expansion.
double IntegrationShift(const RegionalExpansion& expansion, const Cost& cost);

}  // namespace polyest::internal
