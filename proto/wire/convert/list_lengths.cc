#include "proto/wire/convert/list_lengths.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <google/protobuf/descriptor.h>

#include <string>
#include <vector>

#include "core/common/field_error.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr int kMaxEntries = 10'000;

bool HoldsNumbers(const FieldDescriptor& field) {
  return field.cpp_type() != FieldDescriptor::CPPTYPE_STRING &&
         field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE;
}

// `path` is the message's own, with a dot behind it unless it is empty.
absl::Status CheckMessage(const Message& message, const std::string& path) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* const field : fields) {
    if (HoldsNumbers(*field)) continue;
    const std::string name = path + field->json_name();
    const bool is_message = field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    if (!field->is_repeated()) {
      if (!is_message) continue;
      POLYEST_RETURN_IF_ERROR(CheckMessage(reflection.GetMessage(message, field), name + "."));
      continue;
    }
    const int size = reflection.FieldSize(message, field);
    if (size > kMaxEntries) {
      return InvalidField(
          name, absl::StrFormat("%d entries are more than there may be, %d", size, kMaxEntries));
    }
    for (int i = 0; is_message && !field->is_map() && i < size; ++i) {
      POLYEST_RETURN_IF_ERROR(CheckMessage(reflection.GetRepeatedMessage(message, field, i),
                                           absl::StrCat(name, "[", i, "].")));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckListLengths(const Message& message) { return CheckMessage(message, ""); }

}  // namespace polyest::internal
