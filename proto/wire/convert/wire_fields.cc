#include "proto/wire/convert/wire_fields.h"

#include <absl/strings/ascii.h>

#include <map>
#include <optional>
#include <string>

#include "core/common/field_error.h"

namespace polyest::internal {
namespace {

using Names = std::map<std::string, std::string>;

// Fields whose JSON name is not the core's name in camel case. They are fields of a request itself,
// where the names of counts end in "Count", and fields of measurements. Structures inside of a
// request, such as `expansion.points`, have the core's names.
const Names kNamesOfRequests{{"density_bins", "densityBinCount"}, {"draws", "drawCount"},
                             {"joint_bins", "jointBinCount"},     {"lags", "lagCount"},
                             {"max_rows", "maxRowCount"},         {"points", "pointCount"},
                             {"samples", "sampleCount"}};
const Names kNamesOfMeasurements{{"columns", "channels"}, {"value", "values"}};
const Names kNoOtherNames;

const Names& OtherNames(const FieldPath& field) {
  const FieldStep& first = field.steps().front();
  if (first == FieldStep("measurements") || first == FieldStep("record")) {
    return kNamesOfMeasurements;
  }
  return field.steps().size() == 1 ? kNamesOfRequests : kNoOtherNames;
}

std::string CamelCase(const std::string& name) {
  std::string camel;
  bool upper = false;
  for (const char c : name) {
    if (c == '_') {
      upper = true;
      continue;
    }
    camel += upper ? absl::ascii_toupper(static_cast<unsigned char>(c)) : c;
    upper = false;
  }
  return camel;
}

}  // namespace

absl::Status WireFields(const absl::Status& status) {
  const std::optional<FieldPath> field = FieldOf(status);
  if (!field || field->empty()) return status;
  const Names& others = OtherNames(*field);
  return RenameFields(status, [&others](const std::string& name) {
    const auto other = others.find(name);
    return other == others.end() ? CamelCase(name) : other->second;
  });
}

}  // namespace polyest::internal
