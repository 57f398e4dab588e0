#pragma once

// Keeps, in a file beside the journal's database and its write-ahead log, how far each session had
// come when its last batch was acknowledged. SQLite ends the log at the first damaged frame without
// a word; the seals tell that batches are missing then, and which.
//
// A seal is written at every commit, before the batches are acknowledged, and is on disk within a
// second. It never runs ahead of the database; after a power failure it may be up to a second
// behind.

#include <absl/status/statusor.h>

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace polyest::internal {

struct Seal {
  int64_t session = 0;  // its number in the journal
  std::string label;    // its tenant and name, for people; cut off if long
  // The digest of its row when it is shown (SessionDigest). A restored database may have another
  // session of this number.
  std::string head;
  int64_t from = 0;      // the batches up to here are not in the chain
  int64_t sequence = 0;  // number of the last batch
  // H(… H(H(32 zeros · d₁) · d₂) … dₙ), where H is SHA-256 and dᵢ are the digests of the batches
  // after `from`.
  std::string chain;

  // Returns a seal without batches in its chain.
  static Seal At(int64_t session, std::string label, std::string head, int64_t sequence);
  // Goes on to the next batch. One that does not follow the last begins a new chain.
  void Add(int64_t next, const std::string& digest);
};

// Thread-safe.
class SessionSeals {
 public:
  // Opens the file, or makes it for its owner only. FAILED_PRECONDITION if that is not possible.
  static absl::StatusOr<std::unique_ptr<SessionSeals>> Open(const std::string& file);
  // Syncs and closes the file.
  ~SessionSeals();
  SessionSeals(const SessionSeals&) = delete;
  SessionSeals& operator=(const SessionSeals&) = delete;

  // Returns whether Open has made the file.
  bool made() const { return made_; }
  // Returns the number of seals that could not be read, because they are damaged.
  int damaged() const { return damaged_; }
  std::vector<Seal> All() const;
  std::optional<Seal> Of(int64_t session) const;

  // Writes a seal in the place of the session's last one; errors are left to the next write.
  void Put(const Seal& seal);
  void Remove(int64_t session);
  // Waits until everything written is on disk.
  void Sync();

 private:
  SessionSeals(int descriptor, bool made);
  absl::Status ReadAll();
  void Write(int64_t slot, const std::string& record);
  void SyncLater(std::stop_token stop);

  const int descriptor_;
  const bool made_;
  int damaged_ = 0;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  bool dirty_ = false;
  std::map<int64_t, Seal> seals_;     // by session
  std::map<int64_t, int64_t> slots_;  // places in the file, by session
  std::set<int64_t> free_;            // places of no seal
  int64_t end_ = 0;                   // number of places
  std::jthread syncing_;
};

}  // namespace polyest::internal
