#include "tests/unit/proto/contract_style.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>

#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <iterator>

namespace polyest::internal {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::MethodDescriptor;
using google::protobuf::ServiceDescriptor;

constexpr char kPackage[] = "polyest.v1";

// Lists the quantities that mean nothing without a unit.
const std::set<std::string>& Dimensional() {
  static const std::set<std::string> words = {
      "age",   "angle",    "delay", "duration", "frequency", "interval", "length", "memory", "mass",
      "phase", "position", "speed", "step",     "time",      "timeout",  "until",  "uptime"};
  return words;
}

// Lists answers of methods that are resources and no messages of their own.
const std::set<std::string>& Resources() {
  static const std::set<std::string> names = {"DaemonStatus", "Estimate",      "Model",
                                              "Operation",    "SessionRecord", "Session"};
  return names;
}

std::string NameOf(const std::string& full_name) {
  return std::string(absl::StripPrefix(full_name, absl::StrCat(kPackage, ".")));
}

// Turns "ModelService" into "model_service".
std::string Snake(const std::string& name) {
  std::string snake;
  for (const char c : name) {
    if (absl::ascii_isupper(c) && !snake.empty()) snake += '_';
    snake += absl::ascii_tolower(c);
  }
  return snake;
}

template <typename Element>
std::string CommentOf(const Element& element) {
  google::protobuf::SourceLocation location;
  if (!element.GetSourceLocation(&location)) return "";
  return std::string(absl::StripAsciiWhitespace(location.leading_comments));
}

bool IsInteger(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_INT32 ||
         field.cpp_type() == FieldDescriptor::CPPTYPE_INT64;
}
bool IsUnsigned(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_UINT32 ||
         field.cpp_type() == FieldDescriptor::CPPTYPE_UINT64;
}
bool IsReal(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE ||
         field.cpp_type() == FieldDescriptor::CPPTYPE_FLOAT;
}

// Returns whether a field's comment says when it may be left out, or who sets it.
bool SaysPresence(const std::string& comment) {
  for (const char* const word : {"Required", "Default", "May be empty", "Output only"}) {
    if (absl::StrContains(comment, word)) return true;
  }
  return false;
}

// Returns whether the message, or one that it is declared in, says that the daemon sets all of it.
bool IsOutput(const Descriptor* message) {
  for (; message != nullptr; message = message->containing_type()) {
    if (absl::StrContains(CommentOf(*message), "Output only")) return true;
  }
  return false;
}

}  // namespace

ContractStyle::Exceptions ContractStyle::Unused() const {
  Exceptions unused;
  std::set_difference(exceptions_.begin(), exceptions_.end(), used_.begin(), used_.end(),
                      std::inserter(unused, unused.end()));
  return unused;
}

void ContractStyle::Note(const std::string& name, const std::string& breach) {
  breaches_.push_back(absl::StrCat(name, ": ", breach));
}

void ContractStyle::NoteUnlessExcepted(const std::string& name, const std::string& breach) {
  if (exceptions_.contains(name)) {
    used_.insert(name);
  } else {
    Note(name, breach);
  }
}

template <typename Element>
void ContractStyle::CheckComment(const Element& element, const std::string& name) {
  const std::string comment = CommentOf(element);
  if (comment.empty()) return Note(name, "has no comment");
  if (!absl::EndsWith(comment, ".")) {
    Note(name, "the comment is no sentence");
  }
}

void ContractStyle::Check(const FileDescriptor& file) {
  if (file.package() != kPackage) Note(file.name(), "is of another package");
  if (file.service_count() > 1) Note(file.name(), "has more than one service");
  for (int i = 0; i < file.message_type_count(); ++i) CheckMessage(*file.message_type(i));
  for (int i = 0; i < file.enum_type_count(); ++i) CheckEnum(*file.enum_type(i));
  for (int i = 0; i < file.service_count(); ++i) CheckService(*file.service(i));
}

void ContractStyle::CheckMessage(const Descriptor& message) {
  if (message.options().map_entry()) return;
  CheckComment(message, NameOf(message.full_name()));
  for (int i = 0; i < message.field_count(); ++i) CheckField(*message.field(i));
  for (int i = 0; i < message.real_oneof_decl_count(); ++i) {
    CheckComment(*message.oneof_decl(i), NameOf(message.oneof_decl(i)->full_name()));
  }
  for (int i = 0; i < message.nested_type_count(); ++i) CheckMessage(*message.nested_type(i));
  for (int i = 0; i < message.enum_type_count(); ++i) CheckEnum(*message.enum_type(i));
}

void ContractStyle::CheckField(const FieldDescriptor& field) {
  const std::string name = NameOf(field.full_name());
  CheckComment(field, name);
  if (IsUnsigned(field)) Note(name, "is an unsigned integer, which many languages lack");
  const std::vector<std::string> words = absl::StrSplit(field.name(), '_');
  const bool is_number = IsInteger(field) || IsReal(field);
  if (is_number && Dimensional().contains(words.back())) {
    NoteUnlessExcepted(name, "is a number without its unit in its name, as in _s");
  }
  const bool is_plural =
      absl::EndsWith(words.back(), "s") && words.back() != "s" && words.back() != "bytes";
  if (IsInteger(field) && !field.is_repeated() && is_plural) {
    NoteUnlessExcepted(name, "is a count without _count in its name");
  }
  // A oneof says itself that one of its members is set.
  if (field.real_containing_oneof() == nullptr && !IsOutput(field.containing_type()) &&
      !SaysPresence(CommentOf(field))) {
    Note(name, "says neither Required, Default, May be empty nor Output only");
  }
}

void ContractStyle::CheckEnum(const EnumDescriptor& enumeration) {
  CheckComment(enumeration, NameOf(enumeration.full_name()));
  if (!absl::EndsWith(enumeration.FindValueByNumber(0)->name(), "_UNSPECIFIED")) {
    Note(NameOf(enumeration.full_name()), "has no value …_UNSPECIFIED = 0");
  }
  for (int i = 0; i < enumeration.value_count(); ++i) {
    CheckComment(*enumeration.value(i), NameOf(enumeration.value(i)->full_name()));
  }
}

void ContractStyle::CheckService(const ServiceDescriptor& service) {
  CheckComment(service, service.name());
  if (!absl::EndsWith(service.name(), "Service")) Note(service.name(), "is no …Service");
  if (service.file()->name() != absl::StrCat("polyest/v1/", Snake(service.name()), ".proto")) {
    Note(service.name(), "is not in a file of its name");
  }
  for (int i = 0; i < service.method_count(); ++i) CheckMethod(*service.method(i));
}

void ContractStyle::CheckMethod(const MethodDescriptor& method) {
  const std::string& name = method.name();
  CheckComment(method, name);
  if (!methods_.insert(name).second) Note(name, "is the name of another method, too");
  if (method.input_type()->name() != absl::StrCat(name, "Request")) {
    Note(name, absl::StrCat("its request is not named ", name, "Request"));
  }
  const std::string& answer = method.output_type()->name();
  const bool deletes = absl::StartsWith(name, "Delete") && answer == "Empty";
  if (answer != absl::StrCat(name, "Response") && !Resources().contains(answer) && !deletes) {
    Note(name, absl::StrCat("its answer is neither a resource nor ", name, "Response"));
  }
  const Descriptor& request = *method.input_type();
  if (absl::StartsWith(name, "Create") &&
      request.FindFieldByName(Snake(name.substr(6))) == nullptr) {
    Note(name, "its request does not hold the resource");
  }
  if (absl::StartsWith(name, "List") &&
      (request.FindFieldByName("page_size") == nullptr ||
       request.FindFieldByName("page_token") == nullptr ||
       method.output_type()->FindFieldByName("next_page_token") == nullptr)) {
    Note(name, "has no pages");
  }
  // Predict computes, too; people know it by its short name.
  const bool computes = absl::StartsWith(name, "Compute") || name == "Predict";
  if (computes != (method.service()->name() == "StudyService")) {
    Note(name, "computes, or is in StudyService, but not both");
  }
  if (computes && request.FindFieldByName("subject") == nullptr) Note(name, "has no subject");
  std::set<const Descriptor*> seen;
  if (method.client_streaming()) CheckStreamed(*method.input_type(), seen);
  if (method.server_streaming()) CheckStreamed(*method.output_type(), seen);
}

void ContractStyle::CheckStreamed(const Descriptor& message, std::set<const Descriptor*>& seen) {
  if (!seen.insert(&message).second) return;
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    if (field.is_map()) {
      NoteUnlessExcepted(NameOf(field.full_name()),
                         "is a map in a streaming message, which LabVIEW cannot import");
    } else if (field.message_type() != nullptr) {
      CheckStreamed(*field.message_type(), seen);
    }
  }
}

}  // namespace polyest::internal
