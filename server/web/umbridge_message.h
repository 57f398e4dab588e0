#pragma once

// The messages of the UM-Bridge protocol about the model that a session is.

#include <absl/status/statusor.h>

#include <string>
#include <string_view>
#include <vector>

#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// A request about a model.
struct UmBridgeRequest {
  enum class Kind {
    kModelInfo,
    kInputSizes,
    kOutputSizes,
    kEvaluate,
    kGradient,
    kApplyJacobian,
    kApplyHessian
  };

  Kind kind = Kind::kModelInfo;
  std::string model;
  std::vector<double> input{};  // the parameters, of the kinds from kEvaluate on
  int output = 0;               // outWrt: 0 is the log posterior, 1 the log likelihood
  double sens = 1;              // of the output, which is one number
  std::vector<double> vec{};    // a direction of the parameters

  // The highest derivatives that the answer needs.
  int DerivativeOrder() const;
};

// Returns whether the protocol has a request of this path that is about a model.
bool IsUmBridgePath(std::string_view path);

// Reads a request. INVALID_ARGUMENT names the member and the rule.
absl::StatusOr<UmBridgeRequest> ReadUmBridgeRequest(std::string_view path, const std::string& body);

// Returns the answer to a request from the densities at its input. INVALID_ARGUMENT if the lengths
// of its vectors are not those of the model.
absl::StatusOr<std::string> UmBridgeAnswer(const UmBridgeRequest& request,
                                           const v1::ComputeLogDensityResponse& density);

// Returns the answer that lists models.
std::string UmBridgeInfo(const std::vector<std::string>& models);

// Returns the answer that is an error.
std::string UmBridgeError(std::string_view type, std::string_view message);

}  // namespace polyest::internal
