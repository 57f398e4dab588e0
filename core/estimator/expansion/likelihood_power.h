#pragma once

// How far an inaccurate expansion may be believed.
//
// The expansion's error is no noise: at one ξ it is systematic, so that many samples that the
// expansion follows badly make the posterior narrow about a wrong place. The collocation points
// show by how much: there the model's own mismatch J_m is known. The posterior is therefore taken
// from the likelihood to the power β, the largest one at which
//   β (J_m − J) has a standard deviation of at most 1 over the posterior ∝ e^{−β J − J_apriori},
//   this posterior has an effective number of collocation points of at least n + 2,
// so that it is nowhere sharper than what the points can confirm. A region that moves to such a
// posterior has a smaller error, and β grows from move to move until it is 1: the continuation from
// large noise to the true one.

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

// In at most so many dimensions elements reliably find the pieces of a posterior that particles
// overlook.
inline constexpr int kFewDimensions = 3;

// Returns the power of the likelihood at which a contraction after `rows` rows keeps what the next
// samples can still make likely. While there are fewer than 2 (n + 2) samples, one that comes may
// weigh as much as all before, and raise a piece of the posterior from a thousandth to several per
// cent. The power is 1 in few dimensions, in which elements follow such pieces.
double PowerOfFirstSamples(const ResolvedProblem& problem, int64_t rows);

// Returns β, at most the power that the cost already has, and that when the expansion is accurate:
// when LargestShift (model_agreement.h) is at most ½, or when check points drawn from a posterior
// show it.
double LikelihoodPower(const RegionalExpansion& expansion, const Cost& cost);

// Returns the shift of AgreementWithModel where its check points can be believed, else the
// LargestShift. Check points that are no draws of a posterior need not be where this one is. They
// are not believed in an element, nor with filters: ½ Σ log(S/σ²) is fitted apart from the outputs,
// and its error may make minima where no check point is.
double BelievedShift(const RegionalExpansion& expansion, const Cost& cost, bool in_element);

}  // namespace polyest::internal
