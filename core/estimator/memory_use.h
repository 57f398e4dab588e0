#pragma once

// Weighs the memory that an estimator needs, so that a daemon can share its memory out. The weight
// follows the sizes of the matrices that dominate; it is no exact count.

#include <cstdint>

#include "core/estimator/component_mixture.h"
#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

// Returns the bytes of an expansion and of what belongs to it.
int64_t BytesOf(const ResolvedProblem& problem, const RegionalExpansion& expansion);

// Returns the bytes of the expansions of all components.
int64_t BytesOf(const ComponentMixture& mixture);

// Returns the bytes of the first expansion of a problem, before there is one.
int64_t ExpectedBytes(const ResolvedProblem& problem);

}  // namespace polyest::internal
