#include "core/umbridge/model_file.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "core/common/status.h"
#include "core/external/clean_text.h"

namespace polyest::internal {
namespace {

using Json = nlohmann::json;

absl::Status Wrong(std::string_view member, const Json& value, std::string_view rule) {
  return absl::FailedPreconditionError(absl::StrFormat(
      "%s: %s %s", member,
      CleanText(value.dump(-1, ' ', false, Json::error_handler_t::replace), 100), rule));
}

// Returns OK if all members of an object are known.
absl::Status Knows(const Json& object, std::string_view where,
                   const std::vector<std::string>& members) {
  for (const auto& [member, value] : object.items()) {
    if (std::ranges::find(members, member) != members.end()) continue;
    return absl::FailedPreconditionError(
        absl::StrFormat("%s has a member %s that is not known; there are %s", where,
                        CleanText(member, 100), absl::StrJoin(members, ", ")));
  }
  return absl::OkStatus();
}

absl::Status ReadText(const Json& object, const char* member, std::string& text) {
  const auto found = object.find(member);
  if (found == object.end()) return absl::OkStatus();
  if (!found->is_string()) return Wrong(member, *found, "must be a string");
  text = CleanText(found->get<std::string>());
  return absl::OkStatus();
}

// Reads a number that is finite and between two bounds, these included.
absl::Status ReadNumber(const Json& object, const char* member, double least, double most,
                        double& number) {
  const auto found = object.find(member);
  if (found == object.end()) return absl::OkStatus();
  if (!found->is_number() || !(*found >= least && *found <= most)) {
    return Wrong(member, *found, absl::StrFormat("must be a number from %g to %g", least, most));
  }
  number = found->get<double>();
  return absl::OkStatus();
}

absl::StatusOr<Quantity> ReadQuantity(const Json& json, const char* list, bool parameter) {
  if (!json.is_object()) return Wrong(list, json, "must be an object with a \"name\"");
  std::vector<std::string> members = {"name", "unit", "meaning"};
  if (parameter) members.push_back("default");
  POLYEST_RETURN_IF_ERROR(Knows(json, list, members));
  Quantity quantity;
  POLYEST_RETURN_IF_ERROR(ReadText(json, "name", quantity.name));
  if (quantity.name.empty()) return Wrong(list, json, "must have a \"name\"");
  POLYEST_RETURN_IF_ERROR(ReadText(json, "unit", quantity.unit));
  POLYEST_RETURN_IF_ERROR(ReadText(json, "meaning", quantity.meaning));
  quantity.has_default = json.contains("default");
  POLYEST_RETURN_IF_ERROR(ReadNumber(json, "default", -1e300, 1e300, quantity.default_value));
  return quantity;
}

absl::Status ReadQuantities(const Json& file, const char* list, bool parameters,
                            std::vector<Quantity>& quantities) {
  const auto found = file.find(list);
  if (found == file.end() || !found->is_array() || found->empty()) {
    return Wrong(list, found == file.end() ? Json() : *found,
                 "must be a list of objects with a \"name\"");
  }
  std::set<std::string> names;
  for (const Json& json : *found) {
    POLYEST_ASSIGN_OR_RETURN(Quantity quantity, ReadQuantity(json, list, parameters));
    if (!names.insert(quantity.name).second)
      return Wrong(list, json, "has the name of another one");
    quantities.push_back(std::move(quantity));
  }
  return absl::OkStatus();
}

// Whether `url` is http:// or https:// with a host, perhaps a port, and nothing else.
bool IsServer(const std::string& url) {
  absl::string_view rest = url;
  if (!absl::ConsumePrefix(&rest, "http://") && !absl::ConsumePrefix(&rest, "https://")) {
    return false;
  }
  return !rest.empty() && rest.find_first_of("/?#@ ") == absl::string_view::npos;
}

absl::Status ReadServers(const Json& file, EvaluationServers& servers) {
  const auto urls = file.find("urls");
  if (urls == file.end() || !urls->is_array() || urls->empty()) {
    return Wrong("urls", urls == file.end() ? Json() : *urls,
                 "must be a list such as [\"http://127.0.0.1:4242\"]");
  }
  for (const Json& url : *urls) {
    if (!url.is_string() || !IsServer(url.get<std::string>())) {
      return Wrong("urls", url, "must be like \"http://127.0.0.1:4242\", without a path");
    }
    servers.urls.push_back(url.get<std::string>());
  }
  double requests = servers.requests_per_server;
  POLYEST_RETURN_IF_ERROR(ReadNumber(file, "requestsPerServer", 1, 1000, requests));
  if (requests != std::floor(requests)) {
    return Wrong("requestsPerServer", file["requestsPerServer"], "must be a whole number");
  }
  servers.requests_per_server = static_cast<int>(requests);
  POLYEST_RETURN_IF_ERROR(ReadNumber(file, "timeoutS", 1e-3, 1e6, servers.timeout_s));
  return ReadNumber(file, "giveUpAfterS", 0, 1e6, servers.give_up_after_s);
}

absl::Status ReadTimes(const Json& file, std::vector<double>& times_s) {
  const auto found = file.find("timesS");
  if (found == file.end()) return absl::OkStatus();
  constexpr char kRule[] = "must be a list of increasing times ≥ 0";
  if (!found->is_array() || found->empty()) return Wrong("timesS", *found, kRule);
  for (const Json& time : *found) {
    if (!time.is_number() || !(time >= 0) || !(time <= 1e300)) return Wrong("timesS", time, kRule);
    const double time_s = time.get<double>();
    if (!times_s.empty() && time_s <= times_s.back()) return Wrong("timesS", time, kRule);
    times_s.push_back(time_s);
  }
  return absl::OkStatus();
}

absl::Status ReadInputSizes(const Json& file, UmBridgeDescription& read) {
  const size_t parameters = read.model.parameters.size();
  read.input_sizes = {static_cast<int>(parameters)};
  const auto found = file.find("inputSizes");
  if (found == file.end()) return absl::OkStatus();
  const std::string rule = absl::StrFormat(
      "must be a list of whole numbers ≥ 0 with the sum %d, the number of parameters", parameters);
  if (!found->is_array()) return Wrong("inputSizes", *found, rule);
  read.input_sizes.clear();
  size_t left = parameters;
  for (const Json& size : *found) {
    if (!size.is_number_integer() || size < 0 || size > left)
      return Wrong("inputSizes", size, rule);
    read.input_sizes.push_back(size.get<int>());
    left -= size.get<size_t>();
  }
  return left == 0 ? absl::OkStatus() : Wrong("inputSizes", *found, rule);
}

absl::Status ReadConfig(const Json& file, UmBridgeDescription& read) {
  const auto config = file.find("config");
  if (config == file.end()) return absl::OkStatus();
  if (!config->is_object()) return Wrong("config", *config, "must be an object");
  if (config->contains("times") && read.time_s.empty()) {
    return Wrong("config", *config, "must not have \"times\", which polyest adds, without timesS");
  }
  if (config->contains("inputs") && !read.model.inputs.empty()) {
    return Wrong("config", *config, "must not have \"inputs\", which polyest adds");
  }
  read.config = config->dump(-1, ' ', false, Json::error_handler_t::replace);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<UmBridgeDescription> ParseUmBridgeDescription(const std::string& name,
                                                             const std::string& json) {
  const Json file = Json::parse(json, nullptr, /*allow_exceptions=*/false);
  if (!file.is_object()) {
    return absl::FailedPreconditionError("the file must be an object in JSON, {\"urls\": …}");
  }
  POLYEST_RETURN_IF_ERROR(
      Knows(file, "the file",
            {"urls", "name", "summary", "parameters", "inputSizes", "inputs", "outputs", "config",
             "timesS", "requestsPerServer", "timeoutS", "giveUpAfterS"}));
  UmBridgeDescription read;
  read.model.name = name;
  read.remote_name = name;
  POLYEST_RETURN_IF_ERROR(ReadText(file, "name", read.remote_name));
  POLYEST_RETURN_IF_ERROR(ReadText(file, "summary", read.model.summary));
  POLYEST_RETURN_IF_ERROR(ReadServers(file, read.servers));
  POLYEST_RETURN_IF_ERROR(ReadQuantities(file, "parameters", true, read.model.parameters));
  POLYEST_RETURN_IF_ERROR(ReadQuantities(file, "outputs", false, read.model.outputs));
  if (file.contains("inputs")) {
    POLYEST_RETURN_IF_ERROR(ReadQuantities(file, "inputs", false, read.model.inputs));
  }
  POLYEST_RETURN_IF_ERROR(ReadInputSizes(file, read));
  POLYEST_RETURN_IF_ERROR(ReadTimes(file, read.time_s));
  if (!read.model.inputs.empty() && !read.time_s.empty()) {
    return Wrong("inputs", file["inputs"],
                 "cannot drive a model with timesS, which is asked once for its whole record");
  }
  POLYEST_RETURN_IF_ERROR(ReadConfig(file, read));
  read.model.equations =
      absl::StrFormat("computed by the model %s of UM-Bridge servers", read.remote_name);
  read.model.source = absl::StrJoin(read.servers.urls, ", ");
  // Another server may compute the same model.
  read.model.identity = Json({read.config, read.input_sizes, read.time_s}).dump();
  return read;
}

}  // namespace polyest::internal
