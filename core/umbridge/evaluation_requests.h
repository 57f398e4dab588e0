#pragma once

// What servers are asked for at the points of an ensemble. A request is written when it is sent and
// not before: each has all that inputs have done since the beginning.

#include <absl/status/statusor.h>

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/propagation/trajectory_ensemble.h"
#include "core/umbridge/input_lines.h"
#include "core/umbridge/model_file.h"
#include "core/umbridge/protocol.h"

namespace polyest::internal {

// Needs nothing but what it holds; thread-safe.
class EvaluationRequests {
 public:
  // Takes the requests for the outputs at `times_s`, or at the times of the description if there
  // are none. Returns FailedPrecondition that names the input if one cannot be told to servers.
  static absl::StatusOr<EvaluationRequests> Make(
      std::shared_ptr<const UmBridgeDescription> description,
      std::shared_ptr<const EnsembleSpecification> specification, const InputSignals& inputs,
      std::span<const double> times_s);

  // Returns the request for a point of the ensemble.
  std::string Of(Eigen::Index point) const;

 private:
  EvaluationRequests() = default;
  absl::Status Drive(const InputSignals& inputs);
  double DelayOf(Eigen::Index point, Eigen::Index input) const;
  Vectors Parameters(Eigen::Index point) const;
  DrivenInputs Inputs(Eigen::Index point) const;

  std::shared_ptr<const UmBridgeDescription> description_;
  std::shared_ptr<const EnsembleSpecification> specification_;
  std::vector<double> times_s_;
  // By input and delay: what the input's shape does up to the last of the times.
  std::vector<std::map<double, InputLines>> shapes_;
};

}  // namespace polyest::internal
