#pragma once

// What filters know of the states and of the parameters that drift after the last sample: at each
// draw of the posterior a normal distribution, whose mixture by the draws' weights is theirs.

#include <vector>

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/posterior/posterior_draws.h"
#include "polyest/estimate.h"

namespace polyest::internal {

// The normal distributions at the draws: draws × quantities, the model's states and then the normal
// scores of the parameters that drift. Without columns if there are no filters.
struct FilteredDraws {
  Matrix mean;
  Matrix deviation;
};

FilteredDraws DrawFiltered(const ResolvedProblem& problem, const RegionalExpansion& expansion,
                           const PosteriorDraws& posterior);

// Summarizes the mixtures; `weights` are those of the draws.
std::vector<FilteredQuantity> DescribeFiltered(const ResolvedProblem& problem,
                                               const FilteredDraws& draws, const Vector& weights);

}  // namespace polyest::internal
