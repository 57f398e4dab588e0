#pragma once

// The file NAME.umbridge.json that describes a model of UM-Bridge servers: where they are, how many
// requests they take at once, and what the numbers mean, which the protocol does not tell.

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "polyest/model.h"

namespace polyest::internal {

// Where a model is computed, and how patiently.
struct EvaluationServers {
  std::vector<std::string> urls;  // "http://HOST:PORT", ≥ 1; all of them have the same model
  int requests_per_server = 1;    // at once, 1 to 1000
  double timeout_s = 600;         // for one evaluation, > 0
  // Evaluations end with an error once no server could be reached for so long, ≥ 0.
  double give_up_after_s = 60;
};

struct UmBridgeDescription {
  ModelDescription model;
  EvaluationServers servers;
  std::string remote_name;  // the model's name at the servers
  // Lengths of the model's input vectors, which take the parameters in their order; their sum is
  // the number of parameters. By default one vector has them all.
  std::vector<int> input_sizes;
  std::string config = "{}";   // a JSON object, sent along with each request
  std::vector<double> time_s;  // of the values of each output; empty: the servers are told times
};

// Reads a description from JSON. Returns FailedPrecondition that names the member, its value and
// the rule that it breaks.
absl::StatusOr<UmBridgeDescription> ParseUmBridgeDescription(const std::string& name,
                                                             const std::string& json);

}  // namespace polyest::internal
