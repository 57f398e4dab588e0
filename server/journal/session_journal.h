#pragma once

// Where sessions are kept: their problems and, batch by batch, what was measured. A batch is
// acknowledged once it is here; an estimator can be made anew from what is here, to the same bits.
//
// A journal is written in order: what is appended later is never kept without what was appended to
// the same session before. Every implementation passes
// tests/unit/server/journal/journal_contract_test.cc.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/timestamp.pb.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "polyest/samples.h"
#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// How far a session has come.
struct SessionPlace {
  int64_t sequence = 0;  // of the last batch; 0: none yet
  int64_t samples = 0;   // values of measured outputs
  int64_t rows = 0;
  SampleRow last_row;
};

struct SessionHead {
  int64_t number = 0;  // the journal's own, never used twice
  std::string tenant;
  std::string name;  // `sessions/{id}`; of a tenant's sessions only one has it
  google::protobuf::Timestamp create_time;
  SessionPlace place;
};

struct JournalBatch {
  int64_t sequence = 0;
  v1::Measurements measurements;
};

// Of a batch that is appended: what it says, and where the session is after it.
struct JournalEntry {
  int64_t session = 0;       // number
  std::string measurements;  // as DeterministicBytes
  std::string digest;        // of these
  SessionPlace place;
};

// The state of a session's estimator after its first `rows` rows, which ended in batch `sequence`
// or an earlier one.
struct JournalSnapshot {
  bool operator==(const JournalSnapshot&) const = default;

  int64_t sequence = 0;
  int64_t rows = 0;
  std::string state;
};

// Threads may share a journal. Errors: NOT_FOUND a session that is not there; RESOURCE_EXHAUSTED a
// full disk; UNAVAILABLE a disk that fails; DATA_LOSS what was kept and cannot be read.
class SessionJournal {
 public:
  // Called once, from any thread; must not wait.
  using Done = std::function<void(const absl::Status&)>;

  virtual ~SessionJournal() = default;

  // Whether what is here outlives the process.
  virtual bool durable() const = 0;
  // Tries to keep something, and forgets it again. Waits.
  virtual absl::Status CheckWritable() { return absl::OkStatus(); }

  // All sessions, in the order of tenants and names. Those that are hidden are not among them.
  virtual absl::StatusOr<std::vector<SessionHead>> Heads() const = 0;
  // A new session, kept when this returns; the head's number and place are ignored. A hidden one is
  // forgotten when the journal is opened again, unless it was shown. ALREADY_EXISTS.
  virtual absl::StatusOr<int64_t> Create(const SessionHead& head, const v1::Problem& problem,
                                         bool hidden) = 0;
  // ALREADY_EXISTS when the name has been taken meanwhile.
  virtual absl::Status Show(int64_t session) = 0;
  virtual absl::Status Delete(int64_t session) = 0;

  // Keeps a batch and calls `done` once it is kept, or is not going to be: FAILED_PRECONDITION when
  // it does not follow the session's last one.
  virtual void Append(JournalEntry entry, Done done) = 0;
  // Keeps the latest snapshot of a session, some time; dropped without a word when the session or
  // the snapshot's batch is not there, or the disk fails: snapshots only save time.
  virtual void SaveSnapshot(int64_t session, JournalSnapshot snapshot) = 0;

  virtual absl::StatusOr<v1::Problem> ReadProblem(int64_t session) const = 0;
  // Batches after batch `after`, in order, until `take` is not OK: its status is then the answer.
  virtual absl::Status ReadBatches(
      int64_t session, int64_t after,
      const std::function<absl::Status(const JournalBatch&)>& take) const = 0;
  // NOT_FOUND when there is no such batch.
  virtual absl::StatusOr<std::string> ReadDigest(int64_t session, int64_t sequence) const = 0;
  virtual absl::StatusOr<std::optional<JournalSnapshot>> ReadSnapshot(int64_t session) const = 0;
};

}  // namespace polyest::internal
