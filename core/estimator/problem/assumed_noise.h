#pragma once

// The noise in whose units the changes of an output are weighed before anything is measured.

#include <algorithm>

#include "core/bayes/noise.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

// Of an output whose noise nobody has told: this much of the range of its predictions.
inline constexpr double kAssumedNoise = 0.01;

inline bool HasNumbers(const NoiseModel& noise) {
  return noise.absolute > 0 || noise.relative > 0 || noise.relative_to_max > 0;
}

// The noise that the problem gives of the output `column` of its model; null when it does not
// measure the output, or does not know the noise.
inline const NoiseModel* GivenNoise(const ResolvedProblem& problem, int column) {
  const auto& outputs = problem.outputs();
  const auto found = std::find(outputs.begin(), outputs.end(), column);
  if (found == outputs.end()) return nullptr;
  const auto channel = static_cast<size_t>(found - outputs.begin());
  const NoiseModel& noise = problem.problem().measured[channel].noise;
  return HasNumbers(noise) ? &noise : nullptr;
}

// kAssumedNoise of the range from the least mean − 2 standard deviations to the largest mean + 2
// standard deviations over the times.
inline NoiseModel AssumedNoise(const ConstVectorRef& mean, const ConstVectorRef& deviation) {
  const double highest = (mean + 2 * deviation).maxCoeff();
  const double lowest = (mean - 2 * deviation).minCoeff();
  return {.absolute = kAssumedNoise * (highest - lowest)};
}

}  // namespace polyest::internal
