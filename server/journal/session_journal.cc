#include "server/journal/session_journal.h"

namespace polyest::internal {

absl::Status SessionJournal::ReadBatchesUpTo(
    int64_t session, int64_t after, int64_t last,
    const std::function<absl::Status(const JournalBatch&)>& take) const {
  const absl::Status enough = absl::OutOfRangeError("the batches have been read");
  const absl::Status read =
      ReadBatches(session, after, [&](const JournalBatch& batch) -> absl::Status {
        return batch.sequence > last ? enough : take(batch);
      });
  return read == enough ? absl::OkStatus() : read;
}

}  // namespace polyest::internal
