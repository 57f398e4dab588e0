#include "client/cli/json_format.h"

#include <absl/strings/ascii.h>
#include <google/protobuf/util/json_util.h>

#include "core/common/check.h"

namespace polyest {

std::string ToJson(const google::protobuf::Message& message, bool several_lines) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = several_lines;
  options.always_print_primitive_fields = true;
  std::string json;
  POLYEST_CHECK(google::protobuf::util::MessageToJsonString(message, &json, options).ok());
  absl::StripTrailingAsciiWhitespace(&json);
  return json;
}

}  // namespace polyest
