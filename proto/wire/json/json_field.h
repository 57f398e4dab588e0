#pragma once

#include <absl/strings/string_view.h>
#include <google/protobuf/descriptor.h>

namespace polyest::internal {

// Returns the field of a message that JSON calls `name`, or that the contract does; null: none.
inline const google::protobuf::FieldDescriptor* FindField(
    const google::protobuf::Descriptor& message, absl::string_view name) {
  for (int i = 0; i < message.field_count(); ++i) {
    const google::protobuf::FieldDescriptor& field = *message.field(i);
    if (field.json_name() == name || field.name() == name) return &field;
  }
  return nullptr;
}

}  // namespace polyest::internal
