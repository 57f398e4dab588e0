#pragma once

// Detects samples that miss what a parameter changes (§3.2): two samples per period can fall on
// every zero crossing. Let y(t) be the measured outputs and s the parameter in units of its prior
// standard deviation. The information of samples at times t_k relative to the prior's is Σ_k
// (∂y/∂s)²/R. It is compared at the sample times and at as many times between them.

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

struct SamplingInformation {
  double at_samples = 0;
  double between = 0;  // the largest over several phases of the intervals, the samples included
  bool undersampled = false;
};

// Returns the information, from runs of the model over the beginning of the record with the
// parameter moved by half a prior standard deviation to each side of the estimate (at most to the
// bounds of Ω). Returns zeros for a problem with streamed inputs or if the model cannot be run.
SamplingInformation InformationBetweenSamples(const ResolvedProblem& problem,
                                              const LearnedNoise& noise, const RowBlock& beginning,
                                              const Vector& map_xi, int parameter);

}  // namespace polyest::internal
