#pragma once

#include <google/protobuf/timestamp.pb.h>

#include <chrono>
#include <functional>
#include <stop_token>

#include "core/fmu/model_library.h"
#include "server/execution/executor.h"
#include "server/security/access_control.h"
#include "server/service/open_calls.h"
#include "server/sessions/session_registry.h"

namespace polyest::internal {

// What the service's calls share; outlives them all.
struct ServiceContext {
  Executor& executor;  // numerics, and whatever may take long
  Executor& intake;    // the taking of batches
  SessionRegistry& sessions;
  OpenCalls& calls;
  const AccessControl& access;
  // Asked for when the drain's time is over: ends work that no call waits for.
  std::stop_token stop;
  const ModelLibrary& models;
  // Of one unary call, or of one batch of a stream.
  std::chrono::seconds max_computing;
  // For what is shown.
  std::function<google::protobuf::Timestamp()> wall_clock;
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
};

}  // namespace polyest::internal
