#pragma once

// Makes sessions in a journal and appends batches to them.

#include <gtest/gtest.h>

#include <future>
#include <string>
#include <utility>

#include "server/digest/digest.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

// Creates a session of tenant t and returns its number.
inline int64_t CreateIn(SessionJournal& journal, const std::string& name,
                        const v1::Problem& problem, bool hidden = false) {
  SessionHead head;
  head.tenant = "t";
  head.name = name;
  const auto number = journal.Create(head, problem, hidden);
  EXPECT_TRUE(number.ok()) << number.status();
  return number.value_or(0);
}

inline JournalEntry EntryOf(int64_t session, int64_t sequence, const v1::Measurements& batch) {
  JournalEntry entry;
  entry.session = session;
  entry.measurements = DeterministicBytes(batch);
  entry.digest = Digest(entry.measurements);
  entry.place.sequence = sequence;
  return entry;
}

// Appends a batch and waits until it is kept, or not.
inline absl::Status AppendTo(SessionJournal& journal, int64_t session, int64_t sequence,
                             const v1::Measurements& batch) {
  std::promise<absl::Status> kept;
  journal.Append(EntryOf(session, sequence, batch),
                 [&](const absl::Status& status) { kept.set_value(status); });
  return kept.get_future().get();
}

}  // namespace polyest::internal
