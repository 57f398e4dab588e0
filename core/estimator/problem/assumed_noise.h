#pragma once

// The noise in whose units changes of an output are judged before anything is measured.

#include <algorithm>

#include "core/bayes/noise.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

// Assumed noise of an output whose noise is not given, as a fraction of the range of its
// predictions.
inline constexpr double kAssumedNoise = 0.01;

// Whether the noise model gives a size of the noise.
inline bool HasNumbers(const NoiseModel& noise) {
  return noise.absolute > 0 || noise.relative > 0 || noise.relative_to_max > 0;
}

// Returns the noise that the problem gives for the model's output `column`, or nullptr when it does
// not measure the output or does not know the noise.
inline const NoiseModel* GivenNoise(const ResolvedProblem& problem, int column) {
  const auto& outputs = problem.outputs();
  const auto found = std::find(outputs.begin(), outputs.end(), column);
  if (found == outputs.end()) return nullptr;
  const auto channel = static_cast<size_t>(found - outputs.begin());
  const NoiseModel& noise = problem.problem().measured[channel].noise;
  return HasNumbers(noise) ? &noise : nullptr;
}

// Returns a noise of kAssumedNoise times the range over all times, from the lowest mean − 2
// standard deviations to the highest mean + 2 standard deviations.
inline NoiseModel AssumedNoise(const ConstVectorRef& mean, const ConstVectorRef& deviation) {
  const double highest = (mean + 2 * deviation).maxCoeff();
  const double lowest = (mean - 2 * deviation).minCoeff();
  return {.absolute = kAssumedNoise * (highest - lowest)};
}

}  // namespace polyest::internal
