#pragma once

// Yields the events of a stream to an HTTP client, from a call or from a shared watch.

#include <absl/status/statusor.h>
#include <google/protobuf/descriptor.h>

#include <memory>
#include <string>

#include "server/web/web_call.h"

namespace polyest::internal {

// Is used by one thread.
class EventSource {
 public:
  // A message as an event: its JSON between "data: " and an empty line.
  using Text = std::shared_ptr<const std::string>;

  virtual ~EventSource() = default;

  // Waits for what happens next, at most until `deadline`, and for the client's socket.
  virtual WebCall::Event Await(int client, WebCall::Clock::time_point deadline) = 0;
  // Returns the message that has come. To be called after kMessage.
  virtual Text Take() = 0;
  // Returns how the stream has ended. To be called after kEnd.
  virtual grpc::Status status() const = 0;
};

// Returns a message of this type, serialized, as an event; the errors of ToJsonText.
absl::StatusOr<EventSource::Text> ToEvent(const std::string& message,
                                          const google::protobuf::Descriptor& type);

// The messages of a call of the client's own. Ends with the first that has no form in JSON.
class CallEvents final : public EventSource {
 public:
  CallEvents(const std::shared_ptr<grpc::Channel>& channel, const WebCall::Request& request,
             const google::protobuf::Descriptor& type)
      : call_(channel, request), type_(type) {}

  WebCall::Event Await(int client, WebCall::Clock::time_point deadline) override;
  Text Take() override { return *event_; }
  grpc::Status status() const override;

 private:
  WebCall call_;
  const google::protobuf::Descriptor& type_;
  absl::StatusOr<Text> event_ = Text();  // of the last message
};

}  // namespace polyest::internal
