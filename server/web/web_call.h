#pragma once

// Calls a method of the daemon's own gRPC server on behalf of an HTTP client, and waits for its
// messages and for the client at the same time.

#include <absl/functional/function_ref.h>
#include <grpcpp/channel.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/web/wake_up.h"

namespace polyest::internal {

// Is used by one thread. A method of any kind can be called whose client sends one message.
class WebCall {
 public:
  using Clock = std::chrono::steady_clock;

  // Longest time of a call without a limit of its own; its client is watched all the time.
  static constexpr std::chrono::hours kForever{24 * 365};

  struct Request {
    std::string method;  // "/polyest.v1.SessionService/GetSession"
    std::vector<std::pair<std::string, std::string>> metadata{};
    std::optional<std::chrono::microseconds> timeout{};  // none: as long as it takes
    std::string message{};                               // serialized
  };
  enum class Event {
    kMessage,     // a message has come
    kEnd,         // the call has ended, and all its messages have been taken
    kClientGone,  // the client has closed its connection
    kTimeout,     // nothing has happened
  };

  // Starts the call. `channel` leads into the server.
  WebCall(const std::shared_ptr<grpc::Channel>& channel, const Request& request);
  // Cancels the call if it has not ended.
  ~WebCall();
  WebCall(const WebCall&) = delete;
  WebCall& operator=(const WebCall&) = delete;

  // Ends the call early; its status is CANCELLED then. May be called by any thread.
  void Cancel();

  // Waits for what happens next, at most until `deadline`. Every message but the first is asked for
  // only here, so that a server does not send more than the client takes. `client` is the client's
  // socket; negative: there is none to wait for.
  Event Await(int client, Clock::time_point deadline);
  // Waits for the only message of a unary call and for the call's end. Returns how the call has
  // ended; INTERNAL if it has ended well without a message, nothing if the client has closed its
  // connection.
  std::optional<grpc::Status> AwaitOnly(int client, std::string& message);

  // Waits until `look` returns what has happened: at once, and again after each signal of
  // `wake_up`. Otherwise like Await.
  static Event AwaitEvent(const WakeUp& wake_up, int client, Clock::time_point deadline,
                          absl::FunctionRef<std::optional<Event>()> look);

  // Returns the message that has come, serialized, and forgets it.
  std::string TakeMessage();
  // Returns how the call has ended. To be called after kEnd.
  const grpc::Status& status() const;
  // Returns the id of the request that the server has chosen; empty if it sent none. To be called
  // after kEnd.
  std::string request_id() const;

 private:
  class Reactor;

  const std::unique_ptr<Reactor> reactor_;
};

}  // namespace polyest::internal
