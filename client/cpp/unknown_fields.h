#pragma once

// The fields of a JSON text that its message does not have: all of them, where protobuf's parser
// stops at the first.

#include <absl/strings/string_view.h>
#include <google/protobuf/descriptor.h>

#include <string>
#include <vector>

namespace polyest::internal {

struct UnknownField {
  std::string path;        // "uncertain[0].unifrom", "model.equations.tables.f.vlaue"
  std::string suggestion;  // `did you mean "uniform"?`, or "there are lower, upper"; may be empty
};

// Returns the fields in the order of their paths; none for a text that is not one JSON object.
// Values of the wrong type are passed over: the parser reports them.
std::vector<UnknownField> FindUnknownFields(absl::string_view json,
                                            const google::protobuf::Descriptor& message);

}  // namespace polyest::internal
