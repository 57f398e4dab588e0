#pragma once

// Models that are not perfect: process noise (polyest/problem.h) and parameters that drift, and the
// rules for problems whose likelihood is that of prediction errors.

#include <absl/status/status.h>

#include <memory>
#include <string>
#include <vector>

#include "polyest/problem.h"

namespace polyest::internal {

// The maximum number of states of a model whose states are filtered: 2n trajectories run for each
// collocation point.
inline constexpr int kMaxFilteredStates = 32;

// Whether the likelihood is that of the prediction errors of Kalman filters: if it is asked for, or
// if there is process noise, or a parameter drifts, and no likelihood is given.
bool UsesFilters(const Problem& problem);

// Returns the name of the settable quantity (and uncertain parameter) that is the spectral density
// of a state's process noise: "processNoise.v".
std::string SpectralDensityName(const std::string& state);

// Returns the problem with an uncertain parameter for each unknown spectral density or rate of a
// drift that is valid and has none yet, log-uniform between its bounds.
Problem WithHyperparameters(Problem problem);

// Returns the problem's model, with states for the parameters that drift if any does.
std::shared_ptr<const Model> WithDrifts(const Problem& problem);

// Returns what is wrong with the problem's process noise, and what cannot be combined with filters;
// nothing without a model.
std::vector<absl::Status> CheckFilters(const Problem& problem);

// Returns OK for a likelihood of output errors; else INVALID_ARGUMENT, because `what` (such as "a
// cost grid") takes the model for perfect and would be wrong.
absl::Status RefuseFilters(const Problem& problem, const std::string& what);

}  // namespace polyest::internal
