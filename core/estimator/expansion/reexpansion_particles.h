#pragma once

// Particles of the posterior on an expansion, for a re-expansion (reexpansion.h): by importance
// sampling where the posterior is nearly Gaussian or a mixture of such modes
// (guarded_importance.h), which needs some ten thousand evaluations of the cost, and elsewhere by
// tempering (bayes/posterior.h), which needs some hundred thousand.

#include <absl/status/statusor.h>

#include <cstdint>

#include "core/bayes/posterior.h"
#include "core/estimator/expansion/expansion_design.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns equally weighted particles in the design's local coordinates, in random order. `guesses`
// (any number × n, may be none; germ coordinates) are particles of an earlier posterior. They
// depend on the arguments alone. Returns InfeasibleError if the cost is finite almost nowhere;
// otherwise only a stop request returns an error.
absl::StatusOr<Particles> SampleForReexpansion(const Cost& cost, const ExpansionDesign& design,
                                               const Matrix& guesses, uint64_t seed,
                                               const Stop& stop);

}  // namespace polyest::internal
