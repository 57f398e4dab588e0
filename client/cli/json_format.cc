#include "client/cli/json_format.h"

#include <absl/strings/ascii.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver_util.h>

#include <memory>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr char kUrlPrefix[] = "type.googleapis.com";

// Serializes a message with its maps in the order of their keys, so that equal messages give equal
// texts.
std::string Serialize(const google::protobuf::Message& message) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    POLYEST_CHECK(message.SerializeToCodedStream(&coded));
  }
  return bytes;
}

}  // namespace

std::string ToJson(const google::protobuf::Message& message, bool several_lines) {
  namespace util = google::protobuf::util;
  util::JsonPrintOptions options;
  options.add_whitespace = several_lines;
  options.always_print_primitive_fields = true;
  const auto* const descriptor = message.GetDescriptor();
  const std::unique_ptr<util::TypeResolver> types(
      util::NewTypeResolverForDescriptorPool(kUrlPrefix, descriptor->file()->pool()));
  std::string json;
  POLYEST_CHECK(util::BinaryToJsonString(types.get(),
                                         std::string(kUrlPrefix) + "/" + descriptor->full_name(),
                                         Serialize(message), &json, options)
                    .ok());
  absl::StripTrailingAsciiWhitespace(&json);
  return json;
}

}  // namespace polyest::internal
