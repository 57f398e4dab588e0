#pragma once

// The messages of the UM-Bridge protocol 1.0: a model is a function of some vectors (the inputs)
// with values in some vectors (the outputs); a configuration goes with each call.

#include <absl/status/statusor.h>

#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/umbridge/input_lines.h"

namespace polyest::internal {

using Vectors = std::vector<std::vector<double>>;

// What drives a model, by the name of its input.
using DrivenInputs = std::map<std::string, InputLines>;

// Returns the request for the outputs at `input`. To `config`, a JSON object, are added `times_s`
// as the list "times" unless they are empty, and `driven` as "inputs": {NAME: {"times": […],
// "values": […]}, …} unless it is.
std::string EvaluateRequest(const std::string& model, const Vectors& input,
                            const std::string& config, std::span<const double> times_s,
                            const DrivenInputs& driven = {});

// Reads the answer to EvaluateRequest. Returns FailedPrecondition with the reason if the model says
// that it cannot be evaluated there, DataLoss if this is no answer of a model.
absl::StatusOr<Vectors> ReadEvaluation(int http_status, const std::string& body);

}  // namespace polyest::internal
