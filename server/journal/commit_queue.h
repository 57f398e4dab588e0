#pragma once

// Writes to the journal's database from one thread. Writes that arrive during a commit go into the
// next one, so that one wait for the disk serves many. Lanes take turns, and a commit is bounded in
// bytes, so that nobody waits for the many or large writes of another lane.

#include <absl/status/status.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace polyest::internal {

// Describes a commit, successful or not.
struct CommitReport {
  size_t writes = 0;
  std::chrono::duration<double> duration{0};
  absl::Status outcome;
  bool room = true;  // whether there is room on the disk for more than deletions
};

// Whether a write needs room on the disk. One that frees room goes on when the disk is full.
enum class DiskUse { kNeedsRoom, kFreesRoom };

// Called after each commit, before those who wait for it are told; must not wait.
using OnCommit = std::function<void(const CommitReport&)>;

// `Database` is SqliteDatabase or PostgresWriter. It has
//   absl::Status Commit(const std::vector<Write>& writes, std::vector<absl::Status>& outcomes),
// which commits all writes in one transaction, or none of them if it returns an error, and sets the
// outcome of each, which are OK at first.
template <typename Database>
class CommitQueue {
 public:
  // Changes the database. NOT_FOUND, ALREADY_EXISTS and FAILED_PRECONDITION mean that the write has
  // changed nothing and that others may be committed; so does, in SQLite, the refusal of a value
  // that is too large. Any other error undoes the whole commit.
  using Write = std::function<absl::Status(Database&)>;
  // Called once, from the writing thread, with OK when the write is on disk.
  using Done = std::function<void(const absl::Status&)>;

  // Tells the writing thread what to do about a full disk. Default: nothing.
  struct FullDisk {
    // Returns with what writes that need room are refused before a commit, if at all.
    std::function<absl::Status(Database&)> check{};
    // Called when the disk is full; returns whether that has freed some of it.
    std::function<bool()> make{};
  };

  CommitQueue(std::unique_ptr<Database> database, OnCommit on_commit, FullDisk full_disk);
  explicit CommitQueue(std::unique_ptr<Database> database, OnCommit on_commit = {})
      : CommitQueue(std::move(database), std::move(on_commit), FullDisk()) {}
  // Writes everything submitted, then ends.
  ~CommitQueue();
  CommitQueue(const CommitQueue&) = delete;
  CommitQueue& operator=(const CommitQueue&) = delete;

  // Largest number of bytes that the writes of one commit have together: others wait for it, a few
  // milliseconds on a solid-state disk. A larger write goes alone among large ones, and never twice
  // in a row while others wait.
  static constexpr int64_t kMaxBytes = int64_t{256} << 10;

  // Queues a write of so many bytes. The writes of a lane run in the order of the calls; any thread
  // may call this.
  void Submit(Write write, Done done, const std::string& lane = "", int64_t bytes = 0,
              DiskUse use = DiskUse::kNeedsRoom);
  // Queues a write that nobody waits for: once the writes before it in its lane are done, it goes
  // into the next commit that there is anyway, or into one of its own at the end.
  void SubmitLazily(Write write, const std::string& lane = "");
  // Waits until lazy writes submitted so far are on disk, or could not be written.
  void Flush();
  // Submits a write and waits for its outcome.
  absl::Status Run(Write write, const std::string& lane = "", DiskUse use = DiskUse::kNeedsRoom);

 private:
  struct Item {
    Write write;
    Done done;
    int64_t bytes = 0;
    DiskUse use = DiskUse::kNeedsRoom;
  };
  // Holds what goes into one commit.
  struct Group {
    void Add(Item item) {
      bytes.push_back(item.bytes);
      uses.push_back(item.use);
      writes.push_back(std::move(item.write));
      done.push_back(std::move(item.done));
    }

    std::vector<Write> writes;
    std::vector<Done> done;
    std::vector<int64_t> bytes;
    std::vector<DiskUse> uses;
  };

  // The following are called by the queue's thread, without the mutex.
  void Serve();
  Group Take();
  void Commit(Group group);
  static bool RefuseThoseThatNeedRoom(Group& group, const absl::Status& refusal);
  // The following are called with the mutex held.
  void TakeTurns(Group& group, bool large);
  void TakeLazy(Group& group);

  std::unique_ptr<Database> database_;
  const OnCommit on_commit_;
  const FullDisk full_disk_;
  std::mutex mutex_;
  std::condition_variable submitted_;
  std::map<std::string, std::deque<Item>> lanes_;    // those with writes
  std::deque<std::string> turns_;                    // the lanes, the next one first
  bool large_before_ = false;                        // whether the last commit had a large write
  std::vector<std::pair<std::string, Write>> lazy_;  // with their lanes
  bool ending_ = false;
  std::jthread thread_;
};

}  // namespace polyest::internal
