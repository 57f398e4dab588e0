// Writes the JSON schema of problem files from the descriptors of problem.proto, its comments as
// descriptions: once as JSON and once as a C++ source for those who print it.
//
//   problem_schema_generator DESCRIPTOR_SET SCHEMA.json SCHEMA.cc
//
// The schema takes what is canonical: the lowerCamel names of fields and the names of enumerators.
// A field or a oneof whose comment has the word "Required" is required, but not with "Required if".

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver_util.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::OneofDescriptor;
using google::protobuf::Struct;
using google::protobuf::Value;

constexpr char kPackage[] = "polyest.v1.";
constexpr char kRoot[] = "polyest.v1.Problem";
// A number for which files may also say AUTO (proto/wire/transport/automatic_order.h).
constexpr char kOrder[] = "polyest.v1.ExpansionOptions.order";

[[noreturn]] void Fail(const std::string& message) {
  std::cerr << "problem_schema_generator: " << message << std::endl;
  std::exit(EXIT_FAILURE);
}

Value& Member(Struct& object, const std::string& name) { return (*object.mutable_fields())[name]; }
Struct& Object(Struct& object, const std::string& name) {
  return *Member(object, name).mutable_struct_value();
}
Struct& AddObject(Struct& object, const std::string& list) {
  return *Member(object, list).mutable_list_value()->add_values()->mutable_struct_value();
}
void AddText(Struct& object, const std::string& list, const std::string& text) {
  Member(object, list).mutable_list_value()->add_values()->set_string_value(text);
}
void SetText(Struct& object, const std::string& name, const std::string& text) {
  Member(object, name).set_string_value(text);
}

// A comment's lines flow; those set off by spaces, such as formulas, stay lines.
template <typename Element>
std::string CommentOf(const Element& element) {
  google::protobuf::SourceLocation location;
  if (!element.GetSourceLocation(&location)) return "";
  std::istringstream lines(location.leading_comments);
  std::string text;
  bool set_off = false;
  for (std::string line; std::getline(lines, line);) {
    const size_t start = line.find_first_not_of(' ');
    const bool was_set_off = set_off;
    set_off = start == std::string::npos || start > 1;
    if (start != std::string::npos) line.erase(0, start);
    if (!text.empty()) text += set_off || was_set_off ? "\n" : " ";
    text += line;
  }
  return text;
}

template <typename Element>
void Describe(const Element& element, Struct& schema) {
  const std::string comment = CommentOf(element);
  if (!comment.empty()) SetText(schema, "description", comment);
}

template <typename Element>
bool IsRequired(const Element& element) {
  const std::string comment = CommentOf(element);
  const size_t at = comment.find("Required");
  return at != std::string::npos && comment.compare(at, 11, "Required if") != 0;
}

std::string NameOf(const std::string& full_name) {
  return full_name.substr(std::string(kPackage).size());
}

class Generator {
 public:
  Struct Schema(const Descriptor& root) {
    Struct schema;
    SetText(schema, "$schema", "http://json-schema.org/draft-07/schema#");
    SetText(schema, "title", "polyest problem");
    AddMessage(root, schema);
    while (!pending_.empty()) {
      const Descriptor& message = *pending_.back();
      pending_.pop_back();
      AddMessage(message, Definition(schema, message.full_name()));
    }
    for (const EnumDescriptor* enumeration : enumerations_) {
      AddEnumeration(*enumeration, Definition(schema, enumeration->full_name()));
    }
    return schema;
  }

 private:
  static Struct& Definition(Struct& schema, const std::string& full_name) {
    return Object(Object(schema, "definitions"), NameOf(full_name));
  }

  void Refer(const std::string& full_name, Struct& schema) {
    SetText(schema, "$ref", "#/definitions/" + NameOf(full_name));
  }

  void AddMessage(const Descriptor& message, Struct& schema) {
    Describe(message, schema);
    SetText(schema, "type", "object");
    Member(schema, "additionalProperties").set_bool_value(false);
    Struct& properties = Object(schema, "properties");
    for (int i = 0; i < message.field_count(); ++i) {
      const FieldDescriptor& field = *message.field(i);
      Struct& property = Object(properties, field.json_name());
      Describe(field, property);
      if (field.full_name() == kOrder) {
        AddOrder(property);
      } else {
        AddField(field, property);
      }
      if (IsRequired(field)) AddText(schema, "required", field.json_name());
    }
    for (int i = 0; i < message.real_oneof_decl_count(); ++i) {
      AddOneof(*message.oneof_decl(i), AddObject(schema, "allOf"));
    }
  }

  // Exactly one of its fields, or, if it is not required, at most one.
  static void AddOneof(const OneofDescriptor& oneof, Struct& schema) {
    Struct none;
    for (int i = 0; i < oneof.field_count(); ++i) {
      AddText(AddObject(schema, "oneOf"), "required", oneof.field(i)->json_name());
      AddText(AddObject(none, "anyOf"), "required", oneof.field(i)->json_name());
    }
    if (!IsRequired(oneof)) Object(AddObject(schema, "oneOf"), "not") = none;
  }

  static void AddOrder(Struct& schema) {
    Struct& number = AddObject(schema, "anyOf");
    SetText(number, "type", "integer");
    Member(number, "minimum").set_number_value(1);
    SetText(AddObject(schema, "anyOf"), "const", "AUTO");
  }

  void AddField(const FieldDescriptor& field, Struct& schema) {
    if (field.is_map()) {
      SetText(schema, "type", "object");
      AddValue(*field.message_type()->map_value(), Object(schema, "additionalProperties"));
    } else if (field.is_repeated()) {
      SetText(schema, "type", "array");
      AddValue(field, Object(schema, "items"));
    } else {
      AddValue(field, schema);
    }
  }

  void AddValue(const FieldDescriptor& field, Struct& schema) {
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_MESSAGE:
        if (seen_.insert(field.message_type()).second) pending_.push_back(field.message_type());
        return Refer(field.message_type()->full_name(), schema);
      case FieldDescriptor::CPPTYPE_ENUM:
        enumerations_.insert(field.enum_type());
        return Refer(field.enum_type()->full_name(), schema);
      case FieldDescriptor::CPPTYPE_BOOL:
        return SetText(schema, "type", "boolean");
      case FieldDescriptor::CPPTYPE_STRING:
        return SetText(schema, "type", "string");
      case FieldDescriptor::CPPTYPE_DOUBLE:
      case FieldDescriptor::CPPTYPE_FLOAT:
        SetText(AddObject(schema, "anyOf"), "type", "number");
        for (const char* const infinity : {"Infinity", "-Infinity"}) {
          SetText(AddObject(schema, "anyOf"), "const", infinity);
        }
        return;
      case FieldDescriptor::CPPTYPE_INT64:
      case FieldDescriptor::CPPTYPE_UINT64:
        AddText(schema, "type", "string");
        [[fallthrough]];
      case FieldDescriptor::CPPTYPE_INT32:
      case FieldDescriptor::CPPTYPE_UINT32:
        return AddText(schema, "type", "integer");
    }
  }

  // Without its zero, which stands for a field that is left out.
  static void AddEnumeration(const EnumDescriptor& enumeration, Struct& schema) {
    Describe(enumeration, schema);
    for (int i = 0; i < enumeration.value_count(); ++i) {
      if (enumeration.value(i)->number() == 0) continue;
      AddText(schema, "enum", enumeration.value(i)->name());
      AddText(schema, "enumDescriptions", CommentOf(*enumeration.value(i)));
    }
  }

  std::vector<const Descriptor*> pending_;
  std::set<const Descriptor*> seen_;
  std::set<const EnumDescriptor*> enumerations_;
};

// Members in the order of their names, so that the same schema gives the same text.
std::string ToJson(const Struct& schema) {
  namespace util = google::protobuf::util;
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    if (!schema.SerializeToCodedStream(&coded)) Fail("the schema cannot be written");
  }
  const std::unique_ptr<util::TypeResolver> types(util::NewTypeResolverForDescriptorPool(
      "type.googleapis.com", Struct::descriptor()->file()->pool()));
  util::JsonPrintOptions options;
  options.add_whitespace = true;
  std::string json;
  const auto written = util::BinaryToJsonString(
      types.get(), "type.googleapis.com/google.protobuf.Struct", bytes, &json, options);
  if (!written.ok()) Fail("the schema cannot be written as JSON");
  return json;
}

void Write(const char* path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  if (!out.flush()) Fail(std::string(path) + " cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) Fail("usage: problem_schema_generator DESCRIPTOR_SET SCHEMA.json SCHEMA.cc");
  std::ifstream in(argv[1], std::ios::binary);
  google::protobuf::FileDescriptorSet files;
  if (!files.ParseFromIstream(&in)) Fail(std::string(argv[1]) + " cannot be read");
  google::protobuf::DescriptorPool pool;
  for (const auto& file : files.file()) {
    if (pool.BuildFile(file) == nullptr) Fail(file.name() + " cannot be used");
  }
  const Descriptor* const root = pool.FindMessageTypeByName(kRoot);
  if (root == nullptr) Fail(std::string("there is no ") + kRoot);
  const std::string json = ToJson(Generator().Schema(*root));
  Write(argv[2], json);
  Write(argv[3],
        "#include \"proto/problem_schema.h\"\n\nnamespace polyest::internal {\n\n"
        "const char kProblemSchema[] = R\"schema(" +
            json + ")schema\";\n\n}  // namespace polyest::internal\n");
  return EXIT_SUCCESS;
}
