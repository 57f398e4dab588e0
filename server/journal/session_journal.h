#pragma once

// Keeps sessions: their problems and, batch by batch, what was measured. A batch is acknowledged
// once it is in the journal. An estimator that is rebuilt from the journal gives the same estimates
// to the last bit.
//
// A journal is written in order: a batch is never kept without the batches that were appended to
// the same session before it. Every implementation passes
// tests/unit/server/journal/journal_contract_test.cc.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/timestamp.pb.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "polyest/samples.h"
#include "polyest/stop.h"
#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"
#include "server/journal/journal_backup.h"

namespace polyest::internal {

// Describes how far a session has come.
struct SessionPlace {
  int64_t sequence = 0;  // number of the last batch; 0: none yet
  int64_t samples = 0;   // values of measured outputs
  int64_t rows = 0;      // as they arrived
  SampleRow last_row;    // the latest in time
};

// Describes a session without its problem and its batches.
struct SessionHead {
  int64_t number = 0;  // given by the journal, never used twice
  std::string tenant;
  std::string name;  // `sessions/{id}`; unique among the tenant's visible sessions
  google::protobuf::Timestamp create_time;
  SessionPlace place;
  int64_t bytes = 0;            // of its problem and its batches, serialized; set by Heads
  int64_t snapshot_bytes = 0;   // of its snapshot; set by Heads
  double reorder_window_s = 0;  // within which rows may arrive out of order; 0: they may not
};

struct JournalBatch {
  int64_t sequence = 0;
  v1::Measurements measurements;
};

// Holds a batch that is appended, and the place of the session after it.
struct JournalEntry {
  int64_t session = 0;       // number of the session
  std::string measurements;  // serialized by DeterministicBytes
  std::string digest;        // of `measurements`
  SessionPlace place;
};

// Holds the state of a session's estimator after its first `rows` rows, which ended in batch
// `sequence` or an earlier one.
struct JournalSnapshot {
  bool operator==(const JournalSnapshot&) const = default;

  int64_t sequence = 0;
  int64_t rows = 0;
  std::string state;
};

// Holds one estimate of a session's history.
struct JournalHistoryPoint {
  bool operator==(const JournalHistoryPoint&) const = default;

  int64_t ordinal = 0;   // ≥ 0, increasing
  int64_t sequence = 0;  // number of the last batch that it takes into account
  std::string point;     // serialized
};

inline absl::Status NoSuchSession() {
  return absl::NotFoundError("the journal has no such session");
}

// A daemon that shares a journal.
struct JournalNode {
  int64_t number = 0;      // given to no other
  std::string address;     // HOST:PORT at which clients reach it; empty while it starts
  int64_t sessions = 0;    // that it owns
  int64_t streams = 0;     // that were open when it renewed its lease
  double busy_cores = 0;   // processor time a second that it used before that
  double lease_age_s = 0;  // time since it renewed its lease
  bool draining = false;   // whether it hands its sessions over
  bool alive = false;      // whether its lease holds
};

// A journal that several daemons share. Each session belongs to one of them, its owner, and
// sessions come and go without the others. Thread-safe; all but Owns wait for the database.
class SharedJournal {
 public:
  virtual ~SharedJournal() = default;

  // Makes this daemon the owner of a session, the only one that adds to it, and returns its place.
  // UNAVAILABLE, naming the owner, when it belongs to another daemon that lives. Whatever was
  // appended before is either kept, and the place tells of it, or never will be.
  virtual absl::StatusOr<SessionPlace> Claim(int64_t session) = 0;
  // Lets other daemons have a session that this one no longer uses, when all writes of it are done.
  virtual void Release(int64_t session) = 0;
  // Returns whether this daemon owns a session, as far as it knows. One that has lost a session to
  // another finds it out at the latest when it appends.
  virtual bool Owns(int64_t session) const = 0;
  // Returns the visible session of this name, if there is one. UNAVAILABLE, naming the owner, when
  // it belongs to another daemon that lives.
  virtual absl::StatusOr<std::optional<SessionHead>> HeadOf(const std::string& tenant,
                                                            const std::string& name) const = 0;
  // Returns at most `count` of a tenant's sessions with names after `after`, in the order of their
  // names.
  virtual absl::StatusOr<std::vector<SessionHead>> HeadsAfter(const std::string& tenant,
                                                              const std::string& after,
                                                              int64_t count) const = 0;

  // Returns the number of this daemon, which is given to no other.
  virtual int64_t node() const = 0;
  // Returns the daemons that live, and those that own sessions all the same, in the order in which
  // they have started.
  virtual absl::StatusOr<std::vector<JournalNode>> Nodes() const = 0;
  // Asks a daemon to hand its sessions over. NOT_FOUND when it does not live, FAILED_PRECONDITION
  // when no other daemon that lives could take them.
  virtual absl::Status DrainNode(int64_t node) = 0;
  // Takes no sessions from here on, as long as there is another daemon that could.
  virtual void StartDraining() = 0;
  // Waits until this daemon is to hand its sessions over; returns false if `stop` comes first.
  virtual bool AwaitDraining(std::stop_token stop) = 0;
};

// Thread-safe. Errors: NOT_FOUND for a session that does not exist, RESOURCE_EXHAUSTED for a full
// disk, UNAVAILABLE for a disk that fails, DATA_LOSS for data that was kept and cannot be read.
class SessionJournal {
 public:
  // Called once, from any thread; must not wait.
  using Done = std::function<void(const absl::Status&)>;

  virtual ~SessionJournal() = default;

  // Returns whether what the journal keeps outlives the process.
  virtual bool durable() const = 0;
  // Checks that the journal can be written: writes something and removes it again. Waits for the
  // disk.
  virtual absl::Status CheckWritable() { return absl::OkStatus(); }
  // Copies everything kept until now into a file, verifies the copy and returns it. Holds up no
  // write. FAILED_PRECONDITION when the journal is in memory; RESOURCE_EXHAUSTED when there is no
  // room for the copy, or as long as another one exists; the errors of `stop`.
  virtual absl::StatusOr<std::unique_ptr<JournalBackup>> BackUp(const Stop& stop);

  // Returns what the journal can do besides if several daemons share it; null if they do not.
  virtual SharedJournal* shared() { return nullptr; }

  // Returns all sessions that are not hidden, in the order of tenants and names.
  virtual absl::StatusOr<std::vector<SessionHead>> Heads() const = 0;
  // Creates a session, which is kept when this returns, and returns its number; the head's number
  // and place are ignored. A hidden session is deleted when the journal is opened again, unless it
  // has been shown. ALREADY_EXISTS when the session is not hidden and its name is taken.
  virtual absl::StatusOr<int64_t> Create(const SessionHead& head, const v1::Problem& problem,
                                         bool hidden) = 0;
  // Makes a hidden session visible. ALREADY_EXISTS when its name has been taken meanwhile.
  virtual absl::Status Show(int64_t session) = 0;
  virtual absl::Status Delete(int64_t session) = 0;

  // Appends a batch and calls `done` once the batch is kept or cannot be kept. FAILED_PRECONDITION
  // when it does not follow the last one of a session that exists; UNAVAILABLE when the session has
  // been claimed by another daemon. A batch that failed UNAVAILABLE may be kept all the same until
  // the session is claimed again.
  virtual void Append(JournalEntry entry, Done done) = 0;
  // Saves the latest snapshot of a session, now or later. Drops it silently when the session or the
  // snapshot's batch does not exist or the disk fails, because snapshots only save time.
  virtual void SaveSnapshot(int64_t session, JournalSnapshot snapshot) = 0;

  // Saves a point of a session's history, now or later, and drops the points whose ordinal is no
  // multiple of `stride` ≥ 1. Drops it silently under the conditions of SaveSnapshot.
  virtual void SaveHistoryPoint(int64_t session, JournalHistoryPoint point, int64_t stride) = 0;

  // Returns the problem of a session. Waits for the disk, as do the following.
  virtual absl::StatusOr<v1::Problem> ReadProblem(int64_t session) const = 0;
  // Calls `take` with the batches after batch `after`, in order, until it returns an error, which
  // is then returned. OK means that none is missing, also when the session is deleted meanwhile.
  virtual absl::Status ReadBatches(
      int64_t session, int64_t after,
      const std::function<absl::Status(const JournalBatch&)>& take) const = 0;
  // Does the same for batches up to `last` only.
  absl::Status ReadBatchesUpTo(int64_t session, int64_t after, int64_t last,
                               const std::function<absl::Status(const JournalBatch&)>& take) const;
  // Returns the digest of a batch; NOT_FOUND when there is no such batch.
  virtual absl::StatusOr<std::string> ReadDigest(int64_t session, int64_t sequence) const = 0;
  // Returns the latest snapshot of a session, if one was saved. A session that does not exist may
  // count as one without a snapshot.
  virtual absl::StatusOr<std::optional<JournalSnapshot>> ReadSnapshot(int64_t session) const = 0;
  // Returns the points of a session's history in the order of their ordinals. A session that does
  // not exist may count as one without any.
  virtual absl::StatusOr<std::vector<JournalHistoryPoint>> ReadHistory(int64_t session) const = 0;
};

}  // namespace polyest::internal
