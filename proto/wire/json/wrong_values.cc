#include "proto/wire/json/wrong_values.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "core/common/nearest_name.h"
#include "proto/wire/json/json_field.h"

namespace polyest::internal {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::OneofDescriptor;
using google::protobuf::Struct;
using google::protobuf::Value;

constexpr char kObjectRule[] = "an object, in braces { }";

// Returns a value as it stands in the file, or what kind of value it is if it is long.
std::string Shown(const Value& value) {
  constexpr size_t kMaxShown = 60;
  switch (value.kind_case()) {
    case Value::kNumberValue:
      return absl::StrFormat("%.15g", value.number_value());
    case Value::kBoolValue:
      return value.bool_value() ? "true" : "false";
    case Value::kStringValue:
      return value.string_value().size() <= kMaxShown
                 ? absl::StrCat("\"", value.string_value(), "\"")
                 : "a long text";
    case Value::kListValue:
      return "a list";
    case Value::kStructValue:
      return "an object";
    case Value::kNullValue:
    case Value::KIND_NOT_SET:
      return "null";
  }
  return "null";
}

// Returns the number that a value stands for, if any. As in protobuf, that may be a text, "1.5",
// but without blanks. Protobuf also takes "0x10" for 16; here it is no number.
std::optional<double> NumberIn(const Value& value) {
  double number = value.number_value();
  if (value.has_number_value()) return number;
  const std::string& text = value.string_value();
  if (!value.has_string_value() || text != absl::StripAsciiWhitespace(text)) return std::nullopt;
  if (text.find_first_of("xX") != std::string::npos) return std::nullopt;
  return absl::SimpleAtod(text, &number) ? std::optional(number) : std::nullopt;
}

// The rules below return what a value must be; an empty text if it is that.

std::string RuleOfWhole(double limit, const Value& value) {
  const std::optional<double> number = NumberIn(value);
  if (number && *number == std::floor(*number) && *number >= -limit && *number < limit) return "";
  const bool is_large = number && std::abs(*number) >= limit;
  return is_large ? absl::StrFormat("a whole number below 2^%d", std::ilogb(limit))
                  : "a whole number";
}

std::string RuleOfEnum(const EnumDescriptor& type, const Value& value) {
  if (value.has_number_value() && RuleOfWhole(0x1p31, value).empty()) return "";
  std::vector<std::string> names;
  for (int i = 0; i < type.value_count(); ++i) {
    const std::string& name = type.value(i)->name();
    if (value.has_string_value() && value.string_value() == name) return "";
    if (!absl::EndsWith(name, "UNSPECIFIED")) names.push_back(name);
  }
  const std::string nearest = value.has_string_value()
                                  ? NearestName(absl::AsciiStrToUpper(value.string_value()), names)
                                  : "";
  return absl::StrCat("one of ", absl::StrJoin(names, ", "),
                      nearest.empty() ? "" : absl::StrCat("; did you mean ", nearest, "?"));
}

std::string RuleOfBool(const Value& value) {
  const bool is_text = value.string_value() == "true" || value.string_value() == "false";
  return value.has_bool_value() || is_text ? "" : "true or false";
}

// Returns the rule of expansion.order, for which a word stands, too (automatic_order.h).
std::string RuleOfOrder(const Value& value) {
  if (value.string_value() == "AUTO") return "";
  const std::string rule = RuleOfWhole(0x1p31, value);
  return value.has_string_value() && !rule.empty() ? "a whole number or \"AUTO\"" : rule;
}

std::string RuleOf(const FieldDescriptor& field, const Value& value) {
  if (field.full_name() == "polyest.v1.ExpansionOptions.order") return RuleOfOrder(value);
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return RuleOfWhole(0x1p31, value);
    case FieldDescriptor::CPPTYPE_INT64:
      return RuleOfWhole(0x1p63, value);
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT:
      return NumberIn(value) ? "" : "a number";
    case FieldDescriptor::CPPTYPE_BOOL:
      return RuleOfBool(value);
    case FieldDescriptor::CPPTYPE_ENUM:
      return RuleOfEnum(*field.enum_type(), value);
    case FieldDescriptor::CPPTYPE_STRING:
      return value.has_string_value() ? "" : "a text in quotes";
    default:
      return "";
  }
}

// Walks through an object and the message that it should be, to the first wrong value.
class Search {
 public:
  void Walk(const Struct& object, const Descriptor& message, const std::string& prefix) {
    // Messages such as Duration have a special JSON form.
    if (absl::StartsWith(message.full_name(), "google.protobuf.")) return;
    // A protobuf map has no order; std::map gives the fields one.
    const std::map<std::string, Value> fields(object.fields().begin(), object.fields().end());
    std::map<const OneofDescriptor*, std::string> given;
    std::map<const FieldDescriptor*, std::string> names;
    for (const auto& [name, value] : fields) {
      const FieldDescriptor* const field = FindField(message, name);
      // CheckJsonStructure refuses a null where it does not stand for a field that is not given.
      if (field == nullptr || value.has_null_value()) continue;
      const auto [same, is_new] = names.emplace(field, name);
      if (!is_new) return RefuseNames(same->second, name, prefix);
      if (const OneofDescriptor* const choice = field->real_containing_oneof()) {
        const auto [first, is_first] = given.emplace(choice, name);
        if (!is_first) return RefuseBoth(*choice, first->second, name, prefix);
      }
      WalkField(value, *field, prefix.empty() ? name : absl::StrCat(prefix, ".", name));
      if (!wrong_.empty()) return;
    }
  }

  std::string Take() { return std::move(wrong_); }

 private:
  void Refuse(const std::string& path, const Value& value, absl::string_view rule) {
    wrong_ = absl::StrCat(path, ": ", Shown(value), " must be ", rule);
  }

  // Refuses a field under two names; protobuf keeps the value of the last one.
  void RefuseNames(const std::string& first, const std::string& second, const std::string& path) {
    wrong_ = absl::StrCat(path, path.empty() ? "" : ": ", first, " and ", second,
                          " are both given, which is one field");
  }

  void RefuseBoth(const OneofDescriptor& choice, const std::string& first,
                  const std::string& second, const std::string& path) {
    std::vector<std::string> names;
    for (int i = 0; i < choice.field_count(); ++i) names.push_back(choice.field(i)->json_name());
    wrong_ = absl::StrCat(path, path.empty() ? "" : ": ", first, " and ", second,
                          " are both given; only one of ", absl::StrJoin(names, ", "), " may be");
  }

  void WalkField(const Value& value, const FieldDescriptor& field, const std::string& path) {
    if (field.is_map()) return WalkMap(value, field, path);
    if (!field.is_repeated()) return WalkValue(value, field, path);
    if (!value.has_list_value()) return Refuse(path, value, "a list, in brackets [ ]");
    for (int i = 0; i < value.list_value().values_size() && wrong_.empty(); ++i) {
      WalkValue(value.list_value().values(i), field, absl::StrCat(path, "[", i, "]"));
    }
  }

  void WalkMap(const Value& value, const FieldDescriptor& field, const std::string& path) {
    if (!value.has_struct_value()) return Refuse(path, value, kObjectRule);
    const std::map<std::string, Value> entries(value.struct_value().fields().begin(),
                                               value.struct_value().fields().end());
    for (const auto& [key, entry] : entries) {
      if (wrong_.empty()) {
        WalkValue(entry, *field.message_type()->map_value(), absl::StrCat(path, ".", key));
      }
    }
  }

  void WalkValue(const Value& value, const FieldDescriptor& field, const std::string& path) {
    const Descriptor* const message = field.message_type();
    if (message == nullptr) {
      const std::string rule = RuleOf(field, value);
      if (!rule.empty()) Refuse(path, value, rule);
    } else if (value.has_struct_value()) {
      Walk(value.struct_value(), *message, path);
    } else if (!absl::StartsWith(message->full_name(), "google.protobuf.")) {
      Refuse(path, value, kObjectRule);
    }
  }

  std::string wrong_;
};

}  // namespace

std::string RefusalOfNull(const FieldDescriptor& field) {
  const bool is_message = field.message_type() != nullptr;
  const bool is_in_map = field.containing_type()->options().map_entry();
  if (!is_in_map && (field.is_repeated() || is_message)) return "";
  Value null;
  null.set_null_value(google::protobuf::NULL_VALUE);
  return absl::StrCat("null must be ", is_message ? kObjectRule : RuleOf(field, null));
}

std::string FindWrongValue(absl::string_view json, const Descriptor& message) {
  Struct object;
  const auto parsed =
      google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &object);
  if (!parsed.ok()) return "";
  Search search;
  search.Walk(object, message, "");
  return search.Take();
}

}  // namespace polyest::internal
