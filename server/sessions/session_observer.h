#pragma once

// Receives the news of a session. Implemented by those who watch it and by its writer.

#include <memory>

#include "polyest/v1/estimate.pb.h"

namespace polyest::internal {

using SharedEstimate = std::shared_ptr<const v1::Estimate>;

// The methods are called from a strand of the executor, or by the thread that closes the session;
// they must not wait.
class SessionObserver {
 public:
  virtual ~SessionObserver() = default;
  virtual void OnEstimate(const SharedEstimate& estimate) = 0;
  // The session has been deleted. An estimate that is just being passed on may still follow.
  virtual void OnClosed() = 0;
  // The session moves to another daemon of the database, where the client is to go on.
  virtual void OnMoved() {}
  // The writer goes on with another connection. Called for a writer only; no other call follows.
  virtual void OnReplaced() {}
};

}  // namespace polyest::internal
