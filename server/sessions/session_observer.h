#pragma once

// Who hears of a session: those who watch it, and its writer.

#include <memory>

#include "polyest/v1/estimate.pb.h"

namespace polyest::internal {

using SharedEstimate = std::shared_ptr<const v1::Estimate>;

// Called from the session's strand, from the journal, or from whoever closes the session; must not
// wait.
class SessionObserver {
 public:
  virtual ~SessionObserver() = default;
  virtual void OnEstimate(const SharedEstimate& estimate) = 0;
  // The session is deleted. The last call.
  virtual void OnClosed() = 0;
  // The writer goes on with another connection. The last call, and to a writer only.
  virtual void OnReplaced() {}
};

}  // namespace polyest::internal
