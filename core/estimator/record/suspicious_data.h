#pragma once

// Warns of data that are allowed but probably not what was meant. `polyest check` gives these
// warnings before anything is computed, and estimates have them as SUSPICIOUS_DATA.

#include <optional>
#include <string>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/data_facts.h"
#include "core/estimator/record/quantization.h"

namespace polyest::internal {

// What a fit says of one output's samples.
struct ChannelFit {
  double noise = 0;     // root mean square of the noise: as assumed or, if unknown, as learned
  double residual = 0;  // root mean square of the residuals
  double degrees = 0;   // degrees of freedom of the residuals
  bool white = true;    // whether the noise is taken as uncorrelated
  // Whether the residuals are too large for the noise, or too much alike for white noise.
  bool contradicts = false;
};

// Returns the coarse steps of a measured output (quantization.h), unless the problem states for how
// long its noise is correlated; what is learned of that from rounded samples does not make up for
// them. Goes by the noise that the problem states if there is no fit.
std::optional<CoarseSteps> CoarseStepsOf(const ResolvedProblem& problem, size_t channel,
                                         const ColumnFacts& column, const ChannelFit* fit);

// Returns the warnings, each in one sentence with its remedy; none before the first row. The facts
// must be of a record of this problem. `fits` are those of all outputs, or none: what the fitted
// model explains is not suspicious.
std::vector<std::string> WarnOfSuspiciousData(const ResolvedProblem& problem,
                                              const DataFacts& facts,
                                              const std::vector<ChannelFit>& fits = {});

}  // namespace polyest::internal
