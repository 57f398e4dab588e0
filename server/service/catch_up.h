#pragma once

#include <memory>
#include <stop_token>

#include "server/sessions/session.h"

namespace polyest::internal {

// Starts to compute, on the session's strand, what has been added and nobody waits for, and an
// estimate of it if somebody watches, until `stop` or the end of the session. Does nothing if the
// strand refuses the task.
void CatchUp(const std::shared_ptr<Session>& session, const std::stop_token& stop);

}  // namespace polyest::internal
