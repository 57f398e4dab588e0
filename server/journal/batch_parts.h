#pragma once

// A batch that is larger than a commit is kept in parts, each with a commit of its own, so that
// others need not wait for the whole of it. The last part stands in the row of the batch: the batch
// is kept once that row is. Parts without such a row are never read.

#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "server/journal/commit_queue.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

// A piece of a batch's serialized measurements.
struct BatchPart {
  int64_t number = 1;  // ≥ 1, in order
  std::string_view bytes;
};

// Submits a batch to the lane, part by part. `write_part(database, entry, part)` writes a part, and
// `write_last` the last one with the row of the batch. When a part is refused, the batch is refused
// for the same reason, and `remove(database, entry)` removes its parts before anything that is
// submitted later is written.
template <typename Database, typename WritePart, typename WriteLast, typename Remove>
void SubmitInParts(CommitQueue<Database>& queue, JournalEntry entry, const std::string& lane,
                   WritePart write_part, WriteLast write_last, Remove remove,
                   SessionJournal::Done done) {
  constexpr size_t kMost = CommitQueue<Database>::kMaxBytes;
  const auto kept = std::make_shared<const JournalEntry>(std::move(entry));
  const auto refusal = std::make_shared<absl::Status>();  // used by the queue's thread only
  const auto submit = [&](const BatchPart& part, const auto& write, SessionJournal::Done heard) {
    queue.Submit(
        [kept, refusal, part, write](Database& database) -> absl::Status {
          // This status fails this write only, not the others of the same commit.
          if (!refusal->ok()) return absl::FailedPreconditionError("another part was refused");
          return write(database, *kept, part);
        },
        std::move(heard), lane, static_cast<int64_t>(part.bytes.size()));
  };
  BatchPart part{.bytes = kept->measurements};
  for (; part.bytes.size() > kMost; ++part.number, part.bytes.remove_prefix(kMost)) {
    submit({part.number, part.bytes.substr(0, kMost)}, write_part,
           [refusal](const absl::Status& status) { refusal->Update(status); });
  }
  const bool in_parts = part.number > 1;
  submit(part, write_last,
         [&queue, kept, refusal, lane, remove, in_parts,
          done = std::move(done)](const absl::Status& status) {
           const absl::Status outcome = refusal->ok() ? status : *refusal;
           if (!outcome.ok() && in_parts) {
             queue.Submit([kept, remove](Database& database) { return remove(database, *kept); },
                          [](const absl::Status&) {}, lane, 0, DiskUse::kFreesRoom);
           }
           done(outcome);
         });
}

}  // namespace polyest::internal
