#include "proto/wire/json/unknown_fields.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <map>

#include "core/common/nearest_name.h"
#include "proto/wire/json/json_field.h"

namespace polyest::internal {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Struct;
using google::protobuf::Value;

std::vector<std::string> FieldNames(const Descriptor& message) {
  std::vector<std::string> names;
  for (int i = 0; i < message.field_count(); ++i) names.push_back(message.field(i)->json_name());
  return names;
}

class Walker {
 public:
  void Walk(const Struct& object, const Descriptor& message, const std::string& prefix) {
    // Messages such as Duration have a special JSON form.
    if (absl::StartsWith(message.full_name(), "google.protobuf.")) return;
    // A protobuf map has no order; std::map gives the fields one.
    const std::map<std::string, Value> fields(object.fields().begin(), object.fields().end());
    for (const auto& [name, value] : fields) {
      const std::string path = prefix.empty() ? name : absl::StrCat(prefix, ".", name);
      const FieldDescriptor* const field = FindField(message, name);
      if (field == nullptr) {
        unknown_.push_back({path, SuggestName(name, FieldNames(message))});
      } else if (field->is_map()) {
        WalkMap(value, *field, path);
      } else if (field->is_repeated()) {
        WalkList(value, *field, path);
      } else {
        WalkValue(value, *field, path);
      }
    }
  }

  std::vector<UnknownField> Take() { return std::move(unknown_); }

 private:
  void WalkValue(const Value& value, const FieldDescriptor& field, const std::string& path) {
    const Descriptor* const message = field.message_type();
    if (message == nullptr || !value.has_struct_value()) return;
    Walk(value.struct_value(), *message, path);
  }

  void WalkList(const Value& value, const FieldDescriptor& field, const std::string& path) {
    for (int i = 0; i < value.list_value().values_size(); ++i) {
      WalkValue(value.list_value().values(i), field, absl::StrCat(path, "[", i, "]"));
    }
  }

  // Checks the values of a map only: its keys are names chosen by the user.
  void WalkMap(const Value& value, const FieldDescriptor& field, const std::string& path) {
    const std::map<std::string, Value> entries(value.struct_value().fields().begin(),
                                               value.struct_value().fields().end());
    for (const auto& [key, entry] : entries) {
      WalkValue(entry, *field.message_type()->map_value(), absl::StrCat(path, ".", key));
    }
  }

  std::vector<UnknownField> unknown_;
};

}  // namespace

std::vector<UnknownField> FindUnknownFields(absl::string_view json, const Descriptor& message) {
  Struct object;
  const auto parsed =
      google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &object);
  if (!parsed.ok()) return {};
  Walker walker;
  walker.Walk(object, message, "");
  return walker.Take();
}

}  // namespace polyest::internal
