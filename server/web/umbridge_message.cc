#include "server/web/umbridge_message.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

using Json = nlohmann::json;
using Kind = UmBridgeRequest::Kind;

// Texts may hold bytes of clients that are no UTF-8.
std::string Text(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<Kind> KindOf(std::string_view path) {
  static const std::map<std::string_view, Kind> kinds = {
      {"/ModelInfo", Kind::kModelInfo},      {"/InputSizes", Kind::kInputSizes},
      {"/OutputSizes", Kind::kOutputSizes},  {"/Evaluate", Kind::kEvaluate},
      {"/Gradient", Kind::kGradient},        {"/ApplyJacobian", Kind::kApplyJacobian},
      {"/ApplyHessian", Kind::kApplyHessian}};
  const auto found = kinds.find(path);
  return found == kinds.end() ? std::nullopt : std::optional(found->second);
}

absl::StatusOr<std::vector<double>> Numbers(const Json& json, const std::string& name) {
  std::vector<double> numbers;
  bool all = json.is_array();
  for (size_t i = 0; all && i < json.size(); ++i) {
    all = json[i].is_number();
    if (all) numbers.push_back(json[i].get<double>());
  }
  if (!all) return absl::InvalidArgumentError(name + ": must be a list of numbers");
  return numbers;
}

absl::StatusOr<std::vector<double>> Vector(const Json& json, const char* name) {
  if (!json.contains(name)) return absl::InvalidArgumentError(absl::StrCat(name, ": is missing"));
  return Numbers(json[name], name);
}

absl::Status ReadInput(const Json& json, UmBridgeRequest& request) {
  const auto input = json.find("input");
  if (input == json.end() || !input->is_array() || input->size() != 1) {
    return absl::InvalidArgumentError("input: must be a list of one vector, the parameters");
  }
  POLYEST_ASSIGN_OR_RETURN(request.input, Numbers((*input)[0], "input[0]"));
  if (request.input.empty()) return absl::InvalidArgumentError("input[0]: has no numbers");
  return absl::OkStatus();
}

// Reads which vector a derivative is of, or by; there are so many.
absl::StatusOr<int> Index(const Json& json, const char* name, int count) {
  const auto found = json.find(name);
  if (found == json.end() || !found->is_number_integer() || *found < 0 || *found >= count) {
    return absl::InvalidArgumentError(
        absl::StrFormat("%s: must be an integer from 0 to %d", name, count - 1));
  }
  return found->get<int>();
}

absl::Status ReadDerivative(const Json& json, UmBridgeRequest& request) {
  POLYEST_ASSIGN_OR_RETURN(request.output, Index(json, "outWrt", 2));
  const bool hessian = request.kind == Kind::kApplyHessian;
  for (const char* name : hessian ? std::vector{"inWrt1", "inWrt2"} : std::vector{"inWrt"}) {
    POLYEST_RETURN_IF_ERROR(Index(json, name, 1).status());
  }
  if (request.kind != Kind::kApplyJacobian) {
    POLYEST_ASSIGN_OR_RETURN(const std::vector<double> sens, Vector(json, "sens"));
    if (sens.size() != 1) {
      return absl::InvalidArgumentError(
          absl::StrFormat("sens: has %d numbers; each output has 1", sens.size()));
    }
    request.sens = sens[0];
  }
  if (request.kind != Kind::kGradient) {
    POLYEST_ASSIGN_OR_RETURN(request.vec, Vector(json, "vec"));
  }
  return absl::OkStatus();
}

absl::Status CheckLength(const char* name, size_t length,
                         const v1::ComputeLogDensityResponse& density) {
  const auto wanted = static_cast<size_t>(density.parameters_size());
  if (length == wanted) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat("%s: has %d numbers; the model takes %d: %s",
                                                    name, length, wanted,
                                                    absl::StrJoin(density.parameters(), ", ")));
}

// Returns gradient · vec.
double Slope(const v1::ComputeLogDensityResponse::Function& function,
             const std::vector<double>& vec) {
  double slope = 0;
  for (size_t i = 0; i < vec.size(); ++i) slope += function.gradient(static_cast<int>(i)) * vec[i];
  return slope;
}

// Returns sens · Hessian · vec.
std::vector<double> Bend(const v1::ComputeLogDensityResponse::Function& function, double sens,
                         const std::vector<double>& vec) {
  const int n = static_cast<int>(vec.size());
  std::vector<double> bend(vec.size(), 0.0);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      bend[static_cast<size_t>(i)] +=
          sens * function.hessian(i * n + j) * vec[static_cast<size_t>(j)];
    }
  }
  return bend;
}

}  // namespace

int UmBridgeRequest::DerivativeOrder() const {
  if (kind == Kind::kApplyHessian) return 2;
  return kind == Kind::kGradient || kind == Kind::kApplyJacobian ? 1 : 0;
}

bool IsUmBridgePath(std::string_view path) { return KindOf(path).has_value(); }

absl::StatusOr<UmBridgeRequest> ReadUmBridgeRequest(std::string_view path,
                                                    const std::string& body) {
  const Json json = Json::parse(body, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) return absl::InvalidArgumentError("the request must be a JSON object");
  UmBridgeRequest request{.kind = KindOf(path).value(), .model = {}};
  const auto name = json.find("name");
  if (name == json.end() || !name->is_string()) {
    return absl::InvalidArgumentError("name: must be the name of a model");
  }
  request.model = name->get<std::string>();
  const auto config = json.find("config");
  if (config != json.end() && !config->is_null() && !(config->is_object() && config->empty())) {
    return absl::InvalidArgumentError("config: the model has no configuration; must be {}");
  }
  if (request.kind >= Kind::kEvaluate) POLYEST_RETURN_IF_ERROR(ReadInput(json, request));
  if (request.kind > Kind::kEvaluate) POLYEST_RETURN_IF_ERROR(ReadDerivative(json, request));
  return request;
}

absl::StatusOr<std::string> UmBridgeAnswer(const UmBridgeRequest& request,
                                           const v1::ComputeLogDensityResponse& density) {
  const int inputs = density.parameters_size();
  if (request.kind >= Kind::kEvaluate) {
    POLYEST_RETURN_IF_ERROR(CheckLength("input[0]", request.input.size(), density));
  }
  if (request.kind >= Kind::kApplyJacobian) {
    POLYEST_RETURN_IF_ERROR(CheckLength("vec", request.vec.size(), density));
  }
  const auto& function = request.output == 0 ? density.log_posterior() : density.log_likelihood();
  switch (request.kind) {
    case Kind::kModelInfo:
      return Text({{"support",
                    {{"Evaluate", true},
                     {"Gradient", true},
                     {"ApplyJacobian", true},
                     {"ApplyHessian", true}}}});
    case Kind::kInputSizes:
      return Text({{"inputSizes", Json::array({inputs})}});
    case Kind::kOutputSizes:
      return Text({{"outputSizes", Json::array({1, 1})}});
    case Kind::kEvaluate:
      return Text({{"output", Json::array({Json::array({density.log_posterior().value(0)}),
                                           Json::array({density.log_likelihood().value(0)})})}});
    case Kind::kGradient: {
      std::vector<double> gradient(function.gradient().begin(), function.gradient().end());
      for (double& slope : gradient) slope *= request.sens;
      return Text({{"output", gradient}});
    }
    case Kind::kApplyJacobian:
      return Text({{"output", Json::array({Slope(function, request.vec)})}});
    case Kind::kApplyHessian:
      return Text({{"output", Bend(function, request.sens, request.vec)}});
  }
  return absl::InternalError("unexpected kind of request");
}

std::string UmBridgeInfo(const std::vector<std::string>& models) {
  return Text({{"protocolVersion", 1.0}, {"models", models}});
}

std::string UmBridgeError(std::string_view type, std::string_view message) {
  return Text({{"error", {{"type", std::string(type)}, {"message", std::string(message)}}}});
}

}  // namespace polyest::internal
