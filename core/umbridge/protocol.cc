#include "core/umbridge/protocol.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <nlohmann/json.hpp>

#include "core/common/status.h"
#include "core/external/clean_text.h"

namespace polyest::internal {
namespace {

using Json = nlohmann::json;

constexpr size_t kShownBytes = 200;  // of an answer that is none

Json ParseOrDiscarded(const std::string& text) {
  return Json::parse(text, nullptr, /*allow_exceptions=*/false);
}

std::string TextOf(const Json& json, const char* member) {
  const auto found = json.find(member);
  return found != json.end() && found->is_string() ? found->get<std::string>() : "";
}

// Returns the answer's object, FailedPrecondition for an error of the model, else DataLoss.
absl::StatusOr<Json> ReadAnswer(int http_status, const std::string& body) {
  Json json = ParseOrDiscarded(body);
  if (json.is_object() && json.contains("error") && json["error"].is_object()) {
    const std::string type = TextOf(json["error"], "type");
    const std::string message = TextOf(json["error"], "message");
    return absl::FailedPreconditionError(CleanText(
        type.empty() || message.empty() ? type + message : absl::StrCat(type, ": ", message)));
  }
  if (http_status == 200 && json.is_object()) return json;
  return absl::DataLossError(absl::StrFormat("the answer (HTTP %d) is no message of UM-Bridge: %s",
                                             http_status, CleanText(body, kShownBytes)));
}

absl::Status NoVectors() {
  return absl::DataLossError("the answer has no \"output\" that is a list of lists of numbers");
}

}  // namespace

std::string EvaluateRequest(const std::string& model, const Vectors& input,
                            const std::string& config, std::span<const double> times_s,
                            const DrivenInputs& driven) {
  Json full = ParseOrDiscarded(config);
  if (!times_s.empty()) full["times"] = std::vector<double>(times_s.begin(), times_s.end());
  for (const auto& [name, lines] : driven) {
    full["inputs"][name] = Json{{"times", lines.times_s}, {"values", lines.values}};
  }
  return Json{{"name", model}, {"input", input}, {"config", std::move(full)}}.dump();
}

absl::StatusOr<Vectors> ReadEvaluation(int http_status, const std::string& body) {
  POLYEST_ASSIGN_OR_RETURN(const Json json, ReadAnswer(http_status, body));
  const auto output = json.find("output");
  if (output == json.end() || !output->is_array()) return NoVectors();
  Vectors vectors;
  for (const Json& vector : *output) {
    if (!vector.is_array()) return NoVectors();
    std::vector<double>& values = vectors.emplace_back();
    for (const Json& value : vector) {
      if (!value.is_number()) return NoVectors();
      values.push_back(value.get<double>());
    }
  }
  return vectors;
}

}  // namespace polyest::internal
