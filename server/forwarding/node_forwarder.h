#pragma once

// Passes calls about a session on to the daemon of the same database that owns it, so that clients
// may ask any daemon. A call goes on with its deadline, its cancellation, its request id and what
// is known of its caller (node_caller.h); its end comes back as it is. The owner decides whether
// the caller may make the call, by the same rules and limits as if the caller had come to it. A
// call that has been passed on is never passed on again.

#include <absl/status/status.h>
#include <google/protobuf/message_lite.h>
#include <grpcpp/client_context.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/forwarding/node_channels.h"
#include "server/security/access_control.h"

namespace polyest::internal {

// Thread-safe. Calls under way may outlive it.
class NodeForwarder {
 public:
  // Holds what a call to another daemon needs: its context, and the channel it goes by.
  struct Passage {
    std::unique_ptr<grpc::ClientContext> context;
    std::shared_ptr<grpc::Channel> channel;
    std::string owner;  // address of the other daemon
  };

  using Done = std::function<void(const grpc::ClientContext&, const grpc::Status&)>;

  NodeForwarder(const AccessControl& access, std::unique_ptr<NodeChannels> channels)
      : access_(access), channels_(std::move(channels)) {}

  // Returns the passage to the owner of the session, which `refusal` names; nothing if it names
  // none or the call may not be passed on.
  std::optional<Passage> PassageFor(const grpc::CallbackServerContext& call,
                                    const absl::Status& refusal) const;

  // Makes the unary call `path`, "/polyest.v1.SessionService/GetSession", and calls `done` with its
  // outcome from a thread of gRPC's. The messages must live until then.
  static void Call(Passage passage, const std::string& path,
                   const google::protobuf::MessageLite* request,
                   google::protobuf::MessageLite* answer, Done done);

  absl::Status Reload() { return channels_->Reload(); }

 private:
  const AccessControl& access_;
  const std::unique_ptr<NodeChannels> channels_;
};

}  // namespace polyest::internal
