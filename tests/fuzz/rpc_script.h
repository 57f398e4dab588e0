#pragma once

// A script: calls to the service, one after the other, as text that a person can read and write.
//
//   >CreateSession                     a call, and its request in protobuf's text format
//   session_id: "a" problem { … }
//   >StreamMeasurements                a call of several requests:
//   session: "sessions/a" sequence: 1
//   >                                  the next request of the same call
//   sequence: 2
//   >ImportSession!                    cancelled by the client instead of half-closed
//   =GetModel                          a call, and its request as the bytes on the wire
//   …

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace polyest::internal {

// A request, either as a message or as bytes.
struct ScriptRequest {
  std::unique_ptr<google::protobuf::Message> message;  // null if the request is bytes
  std::string bytes;

  std::string Wire() const;
};

struct ScriptCall {
  const google::protobuf::MethodDescriptor* method = nullptr;
  bool cancelled = false;
  std::vector<ScriptRequest> requests;
};

using RpcScript = std::vector<ScriptCall>;

// Returns the methods of all services.
std::vector<const google::protobuf::MethodDescriptor*> FuzzedMethods();
std::unique_ptr<google::protobuf::Message> MakeMessage(const google::protobuf::Descriptor& type);

// Parses as much of the text as possible. A line that names no method ends the request before it,
// and a request ends at its first error.
RpcScript ParseScript(std::string_view text);
std::string PrintScript(const RpcScript& script);

}  // namespace polyest::internal
