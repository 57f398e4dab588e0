#pragma once

// The records of a session, a few at a time.

#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "server/sessions/session.h"

namespace polyest::internal {

// For one thread at a time.
class SessionExport {
 public:
  // What the session has now; batches that come meanwhile are left to the next export.
  explicit SessionExport(std::shared_ptr<const Session> session);

  // The next records, in order; none after the last. Waits for the journal.
  absl::StatusOr<std::vector<v1::SessionRecord>> Next();

 private:
  v1::SessionRecord Head(const v1::Problem& problem) const;

  const std::shared_ptr<const Session> session_;
  const v1::Session described_;
  bool begun_ = false;
  int64_t given_ = 0;  // batches
};

}  // namespace polyest::internal
