#pragma once

// What servers are asked for at the points of an ensemble. A request is written when it is sent and
// not before, since each may be long: it has all that inputs have done since the beginning.

#include <absl/status/statusor.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/propagation/trajectory_ensemble.h"
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
  absl::Status CheckInputs() const;
  absl::StatusOr<InputLines> LinesFor(Eigen::Index point, Eigen::Index input) const;
  double DelayOf(Eigen::Index point, Eigen::Index input) const;
  Vectors Parameters(Eigen::Index point) const;
  DrivenInputs Inputs(Eigen::Index point) const;

  std::shared_ptr<const UmBridgeDescription> description_;
  std::shared_ptr<const EnsembleSpecification> specification_;
  std::vector<double> times_s_;
  InputSignals inputs_;  // as they are known now
};

}  // namespace polyest::internal
