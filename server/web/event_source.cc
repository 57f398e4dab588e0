#include "server/web/event_source.h"

#include <absl/strings/str_cat.h>

#include "core/common/status.h"
#include "server/service/status_mapping.h"
#include "server/web/transcode.h"

namespace polyest::internal {

absl::StatusOr<EventSource::Text> ToEvent(const std::string& message,
                                          const google::protobuf::Descriptor& type) {
  POLYEST_ASSIGN_OR_RETURN(const std::string json, ToJsonText(message, type));
  return std::make_shared<const std::string>(absl::StrCat("data: ", json, "\n\n"));
}

WebCall::Event CallEvents::Await(int client, WebCall::Clock::time_point deadline) {
  const WebCall::Event event = call_.Await(client, deadline);
  if (event != WebCall::Event::kMessage) return event;
  event_ = ToEvent(call_.TakeMessage(), type_);
  return event_.ok() ? event : WebCall::Event::kEnd;
}

grpc::Status CallEvents::status() const {
  return event_.ok() ? call_.status() : ToGrpc(event_.status());
}

}  // namespace polyest::internal
