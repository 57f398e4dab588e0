#pragma once

// Finds all fields of a JSON text that its protobuf message does not have. Protobuf's own parser
// stops at the first.

#include <absl/strings/string_view.h>
#include <google/protobuf/descriptor.h>

#include <string>
#include <vector>

namespace polyest::internal {

struct UnknownField {
  std::string path;  // "uncertain[0].unifrom", "model.equations.tables.f.vlaue"
  // `did you mean "uniform"?`, or "known names: lower, upper"; may be empty.
  std::string suggestion;
};

// Returns the fields in the order of their paths; none if the text is not one JSON object. Skips
// values of the wrong type: the parser reports them.
std::vector<UnknownField> FindUnknownFields(absl::string_view json,
                                            const google::protobuf::Descriptor& message);

}  // namespace polyest::internal
