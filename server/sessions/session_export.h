#pragma once

// Reads the records of a session, a few at a time.

#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "server/sessions/session.h"

namespace polyest::internal {

// For use by one thread at a time.
class SessionExport {
 public:
  // Exports what the session has now; batches that come later are left to the next export.
  explicit SessionExport(std::shared_ptr<const Session> session);

  // Returns the next records, in order; none after the last. Waits for the journal.
  absl::StatusOr<std::vector<v1::SessionRecord>> Next();

 private:
  v1::SessionRecord Head(const v1::Problem& problem) const;
  // Adds the history of the estimates.
  absl::Status AddHistory(std::vector<v1::SessionRecord>& records) const;

  const std::shared_ptr<const Session> session_;
  const v1::Session described_;
  bool begun_ = false, ended_ = false;
  int64_t given_ = 0;  // number of batches returned so far
};

}  // namespace polyest::internal
