#pragma once

// Germs of logarithms for uniform parameters that are estimated together with lognormal or
// log-uniform ones. The data of a mechanical model often tell only products and ratios of
// parameters. These are straight lines if the germs of all are affine in θ, or in log θ; else the
// posterior is a thin curved ridge, which takes many expansions to cover.

#include <vector>

#include "polyest/uncertain_parameter.h"

namespace polyest::internal {

// Returns the parameters with the same distributions, and germs of logarithms for the uniform ones
// if others of the model that do not drift have such. Those that are correlated, of a population or
// drift, and those whose upper bound is more than e^10 times the lower one, keep their germs.
std::vector<UncertainParameter> ByLogarithms(std::vector<UncertainParameter> parameters,
                                             const std::vector<Correlation>& correlations);

}  // namespace polyest::internal
