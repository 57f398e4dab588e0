#pragma once

// The evidence of a problem: the probability density that its model, noise and prior give to the
// samples, ∫ p(z | ξ) p(ξ) dξ. Problems for the same samples are compared by it.
//
// Every sample's density is complete, with its 1/√(2π σ²), so that it has the unit 1/unit of the
// output. Noise of unknown size is integrated with p(s) ∝ 1/s, and an unknown correlation of the
// whitened residuals with the density ½ (the constants that mismatch.h leaves out). Samples that
// are weighed because of outliers have the density of that noise, too, Student's t or Huber's
// (bayes/outlier_density.h).

#include <optional>

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/posterior/posterior_draws.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

// Returns log of the evidence, or of a mixture component's part of it: the integral over its
// element. `draws` are of the cost, `eta` is the minimum of the cost with the noise as stated, in
// local coordinates. Where the cost takes a power of the likelihood the integral is Laplace's
// approximation at `eta`. Returns nothing where the prior's weight α² is not 1 or parameters have
// been eliminated, because the prior is then no density of its own; or where samples are weighed
// because of outliers and the cost takes a power of the likelihood, the size of the noise is not
// learned, or the density at the centre of the weights does not tell of the posterior.
std::optional<double> LogModelEvidence(const ResolvedProblem& problem,
                                       const RegionalExpansion& expansion, const Cost& cost,
                                       const PosteriorDraws& draws, const ConstVectorRef& eta);

// Returns log Σ exp(values); nothing if one of them is not there.
std::optional<double> LogSumOfExponentials(const std::vector<std::optional<double>>& values);

}  // namespace polyest::internal
