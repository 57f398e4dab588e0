#pragma once

#include <google/protobuf/timestamp.pb.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <stop_token>

#include "core/external/model_library.h"
#include "server/execution/executor.h"
#include "server/forwarding/node_forwarder.h"
#include "server/forwarding/placement.h"
#include "server/security/access_control.h"
#include "server/service/open_calls.h"
#include "server/sessions/session_registry.h"

namespace polyest::internal {

// Refers to what the calls of all services share, which outlives them all.
struct ServiceContext {
  Executor& executor;  // runs numerics, and whatever may take long
  Executor& intake;    // takes batches
  SessionRegistry& sessions;
  OpenCalls& calls;
  const AccessControl& access;
  // Signals a stop when the time of the drain is over, to end work that no call waits for.
  std::stop_token stop;
  const ModelLibrary& models;
  // Longest computing time of one unary call, or of one batch of a stream.
  std::chrono::seconds max_computing;
  // Returns the time of day, to be shown only.
  std::function<google::protobuf::Timestamp()> wall_clock;
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
  // Longest time until the first message of a stream, which names its session.
  std::chrono::milliseconds first_message = std::chrono::seconds(10);
  // Bytes of the batches of a stream that wait, to be taken or to be computed, from which on no
  // further message of it is read.
  int64_t held_bytes = 32 << 20;
  // Passes calls on to other daemons of the database; null: they are refused.
  const NodeForwarder* nodes = nullptr;
  // Chooses the daemon for a new session; null: it is this one.
  Placement* placement = nullptr;
};

}  // namespace polyest::internal
