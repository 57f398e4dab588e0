#pragma once

// Finds out whether the daemon answers calls, by calling its own health service from within.

#include <grpcpp/channel.h>
#include <grpcpp/server.h>

#include <chrono>
#include <memory>

namespace polyest::internal {

class SelfCheck {
 public:
  // Makes a channel that leads straight into the server, without a port.
  explicit SelfCheck(grpc::Server& server);

  // Returns whether any answer comes within `timeout`, also one that says NOT_SERVING: a daemon
  // that drains or cannot write its journal is alive. Must not be called by two threads at once.
  bool Answers(std::chrono::milliseconds timeout) const;

 private:
  const std::shared_ptr<grpc::Channel> channel_;
};

}  // namespace polyest::internal
