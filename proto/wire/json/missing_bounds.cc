#include "proto/wire/json/missing_bounds.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>

namespace polyest::internal {
namespace {

using google::protobuf::Struct;
using google::protobuf::Value;

template <typename Prior>
bool HasZeroBound(const Prior& prior) {
  return prior.lower() == 0 || prior.upper() == 0;
}

// Returns the name of a prior with bounds of which one is 0, perhaps because it is missing; null:
// there is none.
const char* PriorToLookAt(const v1::UncertainParameter& parameter) {
  if (parameter.has_uniform() && HasZeroBound(parameter.uniform())) return "uniform";
  if (parameter.has_beta() && HasZeroBound(parameter.beta())) return "beta";
  return nullptr;
}

// Returns a member of an object; the value of an object without it has no kind.
const Value& Member(const Struct& object, const std::string& name) {
  const auto member = object.fields().find(name);
  return member == object.fields().end() ? Value::default_instance() : member->second;
}

}  // namespace

std::string FindMissingBound(absl::string_view json, const v1::Problem& problem) {
  const auto& parameters = problem.uncertain();
  if (std::none_of(parameters.begin(), parameters.end(), PriorToLookAt)) return "";
  Struct object;
  const auto parsed =
      google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &object);
  const auto& entries = Member(object, "uncertain").list_value().values();
  if (!parsed.ok() || entries.size() != parameters.size()) return "";
  for (int i = 0; i < parameters.size(); ++i) {
    const char* const prior = PriorToLookAt(parameters[i]);
    if (prior == nullptr) continue;
    const Struct& given = Member(entries[i].struct_value(), prior).struct_value();
    for (const char* const bound : {"lower", "upper"}) {
      if (given.fields().contains(bound)) continue;
      return absl::StrCat("uncertain[", i, "].", prior, ".", bound, ": is missing; the ", prior,
                          " prior of ", parameters[i].name(), " needs lower and upper");
    }
  }
  return "";
}

}  // namespace polyest::internal
