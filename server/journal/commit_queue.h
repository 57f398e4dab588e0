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
};

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
  // changed nothing and that others may be committed; any other error undoes the whole commit.
  using Write = std::function<absl::Status(Database&)>;
  // Called once, from the writing thread, with OK when the write is on disk.
  using Done = std::function<void(const absl::Status&)>;

  explicit CommitQueue(std::unique_ptr<Database> database, OnCommit on_commit = {});
  // Writes everything submitted, then ends.
  ~CommitQueue();
  CommitQueue(const CommitQueue&) = delete;
  CommitQueue& operator=(const CommitQueue&) = delete;

  // Largest number of bytes that the writes of one commit have together. A larger write goes alone
  // among large ones, and never twice in a row while others wait.
  static constexpr int64_t kMaxBytes = 4 << 20;

  // Queues a write of so many bytes. The writes of a lane run in the order of the calls; any thread
  // may call this.
  void Submit(Write write, Done done, const std::string& lane = "", int64_t bytes = 0);
  // Queues a write that nobody waits for: once the writes before it in its lane are done, it goes
  // into the next commit that there is anyway, or into one of its own at the end.
  void SubmitLazily(Write write, const std::string& lane = "");
  // Waits until lazy writes submitted so far are on disk, or could not be written.
  void Flush();
  // Submits a write and waits for its outcome.
  absl::Status Run(Write write, const std::string& lane = "");

 private:
  struct Item {
    Write write;
    Done done;
    int64_t bytes = 0;
  };
  // Holds what goes into one commit.
  struct Group {
    void Add(Item item) {
      bytes.push_back(item.bytes);
      writes.push_back(std::move(item.write));
      done.push_back(std::move(item.done));
    }

    std::vector<Write> writes;
    std::vector<Done> done;
    std::vector<int64_t> bytes;
  };

  void Serve();
  Group Take();
  // The following are called with the mutex held.
  void TakeTurns(Group& group, bool large);
  void TakeLazy(Group& group);
  void Commit(const Group& group);

  std::unique_ptr<Database> database_;
  const OnCommit on_commit_;
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
