#pragma once

// Finds a value of a JSON text that its protobuf message should not take, and says in plain words
// what it must be. Protobuf's own words for it name its internal types, and some values it takes
// for others: null for 0, "0x10" for 16, "yes" for true, an object for a list of one.

#include <absl/strings/string_view.h>
#include <google/protobuf/descriptor.h>

#include <string>

namespace polyest::internal {

// Returns "null must be a number" or whatever else the field must be, or an empty text where null
// stands for a field that is not given: in place of a list or a message. In place of a number it is
// a number that has been lost: programs write NaN so.
std::string RefusalOfNull(const google::protobuf::FieldDescriptor& field);

// Returns "uncertain[0].uniform.lower: \"low\" must be a number" for the first wrong value in the
// order of the fields' names, or for an object with two members of which only one may be given.
// Empty if the text is not one JSON object, or if there is no such value. CheckJsonStructure must
// have passed the text, which refuses each null that is wrong.
std::string FindWrongValue(absl::string_view json, const google::protobuf::Descriptor& message);

}  // namespace polyest::internal
