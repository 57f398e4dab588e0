#pragma once

// Whether samples miss what a parameter changes (§3.2): two a period can fall on every zero
// crossing. With y(t) the measured outputs and s the parameter in units of its prior standard
// deviation, the information of samples at times t_k, over the prior's, is Σ_k (∂y/∂s)²/R; it is
// compared at the sample times and at as many times between them.

#include "core/estimator/expansion/regional_expansion.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

struct SamplingInformation {
  double at_samples = 0;
  double between = 0;  // the best of several phases between the samples
  bool undersampled = false;
};

// From runs of the model over the beginning of the record, the parameter moved by half a prior
// standard deviation to each side of the estimate (or to the bounds of Ω).
SamplingInformation InformationBetweenSamples(const ResolvedProblem& problem,
                                              const LearnedNoise& noise, const RowBlock& beginning,
                                              const Vector& map_xi, int parameter);

}  // namespace polyest::internal
