#pragma once

// Parameters of runs that share a population: its mean and its spread are two uncertain parameters
// more (bayes/population_cost.h has the model).

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "polyest/problem.h"

namespace polyest::internal {

// Returns the parameters followed by the parts of their population that are not among them yet:
// "v.mean" ("v.median" for a prior that is not normal) and "v.spread".
std::vector<UncertainParameter> WithPopulations(std::vector<UncertainParameter> given);

// Returns InvalidArgument, naming the field and the rule, if a parameter has a population that the
// estimator cannot estimate (UncertainParameter::population).
absl::Status ValidatePopulations(const Problem& problem);

// Returns the unit of the mean or the spread of a population, whose members have the given unit:
// none for a spread that is not one of the quantity itself.
std::string UnitOfPart(PopulationPart part, const UncertainParameter& member,
                       const std::string& unit);

}  // namespace polyest::internal
