#include "proto/wire/json/json_format.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver.h>
#include <google/protobuf/util/type_resolver_util.h>

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "core/common/check.h"
#include "proto/wire/json/json_structure.h"

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

// Turns the coefficients of a direction into a map from the parameters' names to values, which has
// the same bytes.
void MakeCoefficientsAMap(google::protobuf::DescriptorProto& direction) {
  google::protobuf::DescriptorProto& entry = *direction.mutable_nested_type(0);
  POLYEST_CHECK(entry.name() == "Coefficient" && entry.field_size() == 2);
  entry.set_name("CoefficientsEntry");
  entry.mutable_options()->set_map_entry(true);
  const char* const names[] = {"key", "value"};
  for (int i = 0; i < 2; ++i) {
    entry.mutable_field(i)->set_name(names[i]);
    entry.mutable_field(i)->set_json_name(names[i]);
  }
  for (google::protobuf::FieldDescriptorProto& field : *direction.mutable_field()) {
    if (field.name() == "coefficients") {
      field.set_type_name(".polyest.v1.Direction.CoefficientsEntry");
    }
  }
}

// Adds the file and those that it imports to the pool, as JSON has them: the coefficients of a
// direction are {"k": 0.99, "c": 0.1} there. In the contract they are messages, since some
// importers of protocol files know no maps in the messages of a stream.
void AddFile(const google::protobuf::FileDescriptor& file, google::protobuf::DescriptorPool& pool) {
  if (pool.FindFileByName(file.name()) != nullptr) return;
  for (int i = 0; i < file.dependency_count(); ++i) AddFile(*file.dependency(i), pool);
  google::protobuf::FileDescriptorProto copy;
  file.CopyTo(&copy);
  file.CopyJsonNameTo(&copy);
  for (google::protobuf::DescriptorProto& message : *copy.mutable_message_type()) {
    if (message.name() == "Direction") MakeCoefficientsAMap(message);
  }
  POLYEST_CHECK(pool.BuildFile(copy) != nullptr);
}

// Returns the types of the file's messages, and of those that it imports, for JSON. A pool that has
// been returned does not change any more, because other threads read it: a further file makes a
// further pool.
const google::protobuf::DescriptorPool& JsonTypes(const google::protobuf::FileDescriptor& file) {
  static std::mutex mutex;
  static std::vector<const google::protobuf::FileDescriptor*> files;
  // The last one has all `files`; the others may still be read.
  static std::vector<std::unique_ptr<google::protobuf::DescriptorPool>> pools;
  const std::lock_guard lock(mutex);
  if (pools.empty() || pools.back()->FindFileByName(file.name()) == nullptr) {
    files.push_back(&file);
    pools.push_back(std::make_unique<google::protobuf::DescriptorPool>());
    for (const google::protobuf::FileDescriptor* known : files) AddFile(*known, *pools.back());
  }
  return *pools.back();
}

// Finds the details of errors under their standard names, google.rpc.BadRequest, which this program
// knows as polyest.rpc.BadRequest.
class Resolver final : public google::protobuf::util::TypeResolver {
 public:
  explicit Resolver(const google::protobuf::DescriptorPool& pool)
      : types_(google::protobuf::util::NewTypeResolverForDescriptorPool(kUrlPrefix, &pool)) {}

  google::protobuf::util::Status ResolveMessageType(const std::string& url,
                                                    google::protobuf::Type* type) override {
    constexpr absl::string_view kStandard = "type.googleapis.com/google.rpc.";
    if (!absl::StartsWith(url, kStandard)) return types_->ResolveMessageType(url, type);
    return types_->ResolveMessageType(
        absl::StrCat(kUrlPrefix, "/polyest.rpc.", url.substr(kStandard.size())), type);
  }
  google::protobuf::util::Status ResolveEnumType(const std::string& url,
                                                 google::protobuf::Enum* type) override {
    return types_->ResolveEnumType(url, type);
  }

 private:
  const std::unique_ptr<google::protobuf::util::TypeResolver> types_;
};

// A message's type as JSON has it.
struct JsonType {
  explicit JsonType(const google::protobuf::Message& message)
      : resolver(std::make_unique<Resolver>(JsonTypes(*message.GetDescriptor()->file()))),
        url(absl::StrCat(kUrlPrefix, "/", message.GetDescriptor()->full_name())) {}

  const std::unique_ptr<google::protobuf::util::TypeResolver> resolver;
  const std::string url;
};

}  // namespace

std::string ToJson(const google::protobuf::Message& message, bool several_lines) {
  absl::StatusOr<std::string> json = TryToJson(message, several_lines);
  POLYEST_CHECK(json.ok());
  return *std::move(json);
}

absl::StatusOr<std::string> TryToJson(const google::protobuf::Message& message,
                                      bool several_lines) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = several_lines;
  options.always_print_primitive_fields = true;
  const JsonType type(message);
  std::string json;
  const auto written = google::protobuf::util::BinaryToJsonString(
      type.resolver.get(), type.url, Serialize(message), &json, options);
  if (!written.ok()) return absl::InternalError(written.ToString());
  absl::StripTrailingAsciiWhitespace(&json);
  return json;
}

absl::Status FromJson(const std::string& json, google::protobuf::Message& message) {
  if (const auto error = CheckJsonStructure(json, *message.GetDescriptor())) {
    return absl::InvalidArgumentError(
        absl::StrCat("line ", error->line, ", column ", error->column, ": ", error->Sentence()));
  }
  const JsonType type(message);
  std::string bytes;
  const auto read =
      google::protobuf::util::JsonToBinaryString(type.resolver.get(), type.url, json, &bytes);
  if (!read.ok()) return absl::InvalidArgumentError(read.ToString());
  if (!message.ParseFromString(bytes)) {
    return absl::InvalidArgumentError("a text is not valid UTF-8");
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
