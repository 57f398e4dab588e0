#pragma once

// The messages of the UM-Bridge protocol 1.0: a model is a function of some vectors (the inputs)
// with values in some vectors (the outputs); a configuration goes with each call.

#include <absl/status/statusor.h>

#include <span>
#include <string>
#include <vector>

namespace polyest::internal {

using Vectors = std::vector<std::vector<double>>;

// Returns the request for the outputs at `input`. `times_s` are added to `config`, a JSON object,
// as the list "times" unless they are empty.
std::string EvaluateRequest(const std::string& model, const Vectors& input,
                            const std::string& config, std::span<const double> times_s);

// Reads the answer to EvaluateRequest. Returns FailedPrecondition with the reason if the model says
// that it cannot be evaluated there, DataLoss if this is no answer of a model.
absl::StatusOr<Vectors> ReadEvaluation(int http_status, const std::string& body);

}  // namespace polyest::internal
