#include "server/web/transcode.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver_util.h>

#include <memory>
#include <utility>
#include <vector>

#include "proto/wire/json/json_error.h"
#include "proto/wire/json/json_format.h"
#include "proto/wire/json/json_structure.h"
#include "proto/wire/json/unknown_fields.h"
#include "proto/wire/json/wrong_values.h"
#include "proto/wire/transport/automatic_order.h"
#include "server/telemetry/structured_log.h"

namespace polyest::internal {
namespace {

constexpr char kPrefix[] = "type.googleapis.com";
// No more unknown fields than these are named.
constexpr size_t kMaxNamed = 10;
// Longest text in which unknown fields and wrong values are looked for, which takes many times its
// size. Longer ones carry measurements.
constexpr size_t kMaxSearched = size_t{1} << 20;

google::protobuf::util::TypeResolver& Types() {
  static google::protobuf::util::TypeResolver* const types =
      google::protobuf::util::NewTypeResolverForDescriptorPool(
          kPrefix, google::protobuf::DescriptorPool::generated_pool());
  return *types;
}

rpc::Status Invalid(const std::string& message) {
  rpc::Status status;
  status.set_code(grpc::StatusCode::INVALID_ARGUMENT);
  status.set_message(message);
  return status;
}

// Adds the fields that are wrong, as google.rpc.BadRequest, to a status.
rpc::Status WithDetails(rpc::Status status, const rpc::BadRequest& details) {
  auto& any = *status.add_details();
  any.set_type_url("type.googleapis.com/google.rpc.BadRequest");
  details.SerializeToString(any.mutable_value());
  return status;
}

rpc::Status WrongValue(const std::string& message, const std::string& field,
                       const std::string& rule) {
  rpc::BadRequest details;
  details.add_field_violations()->set_field(field);
  details.mutable_field_violations(0)->set_description(rule);
  return WithDetails(Invalid(message), details);
}

// `wrong` is "field: value and rule".
rpc::Status WrongValue(const std::string& wrong) {
  const std::pair<std::string, std::string> parts = absl::StrSplit(wrong, absl::MaxSplits(": ", 1));
  return WrongValue(wrong, parts.first, parts.second);
}

rpc::Status InBody(const JsonError& error) {
  const std::string message = absl::StrCat("line ", error.line, ", column ", error.column,
                                           " of the body: ", error.Sentence());
  return error.field.empty() ? Invalid(message) : WrongValue(message, error.field, error.rule);
}

rpc::Status UnknownFields(const std::vector<UnknownField>& fields) {
  rpc::BadRequest details;
  std::string message;
  for (size_t i = 0; i < std::min(fields.size(), kMaxNamed); ++i) {
    std::string sentence = "unknown field";
    if (!fields[i].suggestion.empty()) absl::StrAppend(&sentence, "; ", fields[i].suggestion);
    auto& violation = *details.add_field_violations();
    violation.set_field(fields[i].path);
    violation.set_description(sentence);
    absl::StrAppend(&message, i == 0 ? "" : ", ", fields[i].path, ": ", sentence);
  }
  return WithDetails(Invalid(message), details);
}

}  // namespace

rpc::Status FromJsonText(const std::string& json, const google::protobuf::Descriptor& type,
                         std::string& bytes) {
  if (absl::StripAsciiWhitespace(json).empty()) return {};
  if (const auto error = CheckJsonStructure(json, type)) return InBody(*error);
  if (!absl::StartsWith(absl::StripLeadingAsciiWhitespace(json), "{")) {
    return Invalid("the body must hold one JSON object");
  }
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = false;
  const auto read = google::protobuf::util::JsonToBinaryString(
      &Types(), absl::StrCat(kPrefix, "/", type.full_name()), WithoutAutomaticOrders(json), &bytes,
      options);
  const bool searched = json.size() <= kMaxSearched;
  const std::string wrong = searched ? FindWrongValue(json, type) : "";
  if (read.ok() && wrong.empty()) return {};
  if (searched && !read.ok()) {
    const std::vector<UnknownField> unknown = FindUnknownFields(json, type);
    if (!unknown.empty()) return UnknownFields(unknown);
  }
  if (!wrong.empty()) return WrongValue(wrong);
  return Invalid(DescribeParserMessage({read.message().data(), read.message().size()}));
}

absl::StatusOr<std::string> ToJsonText(const std::string& bytes,
                                       const google::protobuf::Descriptor& type) {
  const google::protobuf::Message* const prototype =
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type);
  const std::unique_ptr<google::protobuf::Message> message(prototype->New());
  absl::StatusOr<std::string> json = absl::InternalError("a text is not valid UTF-8");
  if (message->ParseFromString(bytes)) json = TryToJson(*message, /*several_lines=*/false);
  if (json.ok()) return json;
  Log(spdlog::level::err, "an answer has no form in JSON",
      {{"type", type.full_name()}, {"error", std::string(json.status().message())}});
  return absl::InternalError("the answer has no form in JSON");
}

rpc::Status ToRpcStatus(const grpc::Status& status) {
  rpc::Status detailed;
  if (!detailed.ParseFromString(status.error_details())) detailed.Clear();
  detailed.set_code(status.error_code());
  detailed.set_message(status.error_message());
  return detailed;
}

}  // namespace polyest::internal
