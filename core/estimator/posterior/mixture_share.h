#pragma once

// The share of the posterior that belongs to a mixture component. Each component has an element of
// Ω (bayes/element.h), and the elements have only their bounds in common, so that nothing is
// counted twice. A component's weight is its evidence, the integral of the density over its
// element,
//   log Z_k = log ∫ e^{−J_k(ξ)} dξ − c_k.
// c_k makes the costs comparable. It is Σ ½ log σ² of the component's own noise, plus the mean over
// the check points of ΔJ, the change of the cost's height by the expansion's own error
// (model_agreement.h). If the check points do not determine that mean, c_k instead uses R, which
// includes the expansion's error, in place of σ². A discounted sample then neither gains nor loses
// in the mean, to first order in the discount.

#include <vector>

#include "core/estimator/expansion/model_agreement.h"
#include "core/estimator/posterior/posterior_draws.h"

namespace polyest::internal {

struct MixtureShare {
  double height = 0;        // c_k: J_k + c_k is comparable among components
  double log_evidence = 0;  // −∞ without draws
};

// Returns c_k.
double HeightOf(const RegionalExpansion& expansion, const Cost& cost);

// Returns the component's share from draws of the cost on the expansion.
MixtureShare ShareOf(const RegionalExpansion& expansion, const Cost& cost,
                     const PosteriorDraws& draws);

// Returns exp(log_evidence) scaled to Σ = 1; equal weights if no component has evidence.
std::vector<double> WeightsOf(const std::vector<double>& log_evidence);

}  // namespace polyest::internal
