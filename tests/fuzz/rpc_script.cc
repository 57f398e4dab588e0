#include "tests/fuzz/rpc_script.h"

#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <utility>

#include "server/security/method_roles.h"

namespace polyest::internal {
namespace {

using google::protobuf::MethodDescriptor;
using google::protobuf::TextFormat;

class NoErrors final : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int, int, const std::string&) override {}
  void AddWarning(int, int, const std::string&) override {}
};

ScriptRequest ParseRequest(const MethodDescriptor& method, bool as_bytes, std::string_view body) {
  ScriptRequest request;
  if (as_bytes) {
    request.bytes = body;
    return request;
  }
  request.message = MakeMessage(*method.input_type());
  NoErrors errors;
  TextFormat::Parser parser;
  parser.RecordErrorsTo(&errors);
  parser.ParseFromString(std::string(body), request.message.get());
  return request;
}

// Returns the method of a name; no two services share one.
const MethodDescriptor* FindMethod(std::string_view name) {
  for (const MethodDescriptor* const method : FuzzedMethods()) {
    if (method->name() == name) return method;
  }
  return nullptr;
}

// Parses one head line (without its end) and the body below it.
void ParsePart(std::string_view head, std::string_view body, RpcScript& script) {
  const bool as_bytes = head.front() == '=';
  const bool cancelled = head.back() == '!';
  head.remove_prefix(1);
  if (cancelled) head.remove_suffix(1);
  if (!head.empty()) {
    const MethodDescriptor* method = FindMethod(head);
    if (method == nullptr) return;
    script.push_back({.method = method, .cancelled = cancelled, .requests = {}});
  }
  if (script.empty()) return;
  script.back().requests.push_back(ParseRequest(*script.back().method, as_bytes, body));
}

}  // namespace

std::string ScriptRequest::Wire() const {
  return message == nullptr ? bytes : message->SerializePartialAsString();
}

std::vector<const MethodDescriptor*> FuzzedMethods() {
  std::vector<const MethodDescriptor*> methods;
  for (const google::protobuf::ServiceDescriptor* const service : Services()) {
    for (int k = 0; k < service->method_count(); ++k) methods.push_back(service->method(k));
  }
  return methods;
}

std::unique_ptr<google::protobuf::Message> MakeMessage(const google::protobuf::Descriptor& type) {
  auto* factory = google::protobuf::MessageFactory::generated_factory();
  return std::unique_ptr<google::protobuf::Message>(factory->GetPrototype(&type)->New());
}

RpcScript ParseScript(std::string_view text) {
  RpcScript script;
  const auto is_head = [&](size_t at) {
    return at < text.size() && (text[at] == '>' || text[at] == '=');
  };
  for (size_t begin = 0; begin < text.size();) {
    const size_t head_end = std::min(text.find('\n', begin), text.size());
    size_t end = head_end;
    while (end < text.size() && !is_head(end + 1))
      end = std::min(text.find('\n', end + 1), text.size());
    if (is_head(begin)) {
      const std::string_view body = text.substr(std::min(head_end + 1, text.size()));
      ParsePart(text.substr(begin, head_end - begin),
                body.substr(0, end - std::min(head_end + 1, end)), script);
    }
    begin = end + 1;
  }
  return script;
}

std::string PrintScript(const RpcScript& script) {
  TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  std::string text;
  for (const ScriptCall& call : script) {
    for (size_t i = 0; i < call.requests.size(); ++i) {
      const ScriptRequest& request = call.requests[i];
      text += request.message == nullptr ? '=' : '>';
      if (i == 0) text += call.method->name() + (call.cancelled ? "!" : "");
      text += '\n';
      std::string body = request.bytes;
      if (request.message != nullptr) printer.PrintToString(*request.message, &body);
      text += body + '\n';
    }
  }
  return text;
}

}  // namespace polyest::internal
