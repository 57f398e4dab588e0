#pragma once

// What could make room for residuals that contradict a perfect model, as far as the problem allows.

#include <string>

#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

// Returns advice to give the states process noise, beginning with "; "; empty where the problem has
// it already or it is not available.
std::string AdviseProcessNoise(const ResolvedProblem& problem);

// Returns advice to let the uncertain parameter drift, beginning with "; "; empty where it does
// already or cannot.
std::string AdviseDrift(const ResolvedProblem& problem, int parameter);

}  // namespace polyest::internal
