#pragma once

// Whether the daemon answers calls, found out by calling its own health service from within.

#include <grpcpp/channel.h>
#include <grpcpp/server.h>

#include <chrono>
#include <memory>

namespace polyest::internal {

class SelfCheck {
 public:
  // Takes no port: the channel leads straight into the server.
  explicit SelfCheck(grpc::Server& server);

  // Whether any answer comes within `timeout`, also one that says NOT_SERVING: a daemon that drains
  // or cannot write its journal is alive. Not to be called by two threads at once.
  bool Answers(std::chrono::milliseconds timeout) const;

 private:
  const std::shared_ptr<grpc::Channel> channel_;
};

}  // namespace polyest::internal
