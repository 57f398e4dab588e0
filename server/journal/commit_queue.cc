#include "server/journal/commit_queue.h"

#include <algorithm>
#include <future>
#include <set>
#include <utility>

#include "server/journal/postgres_writer.h"
#include "server/journal/sqlite_database.h"

namespace polyest::internal {
namespace {

// Largest number of writes in one commit. It bounds what has to be written again when the commit
// fails, and how long others wait for it.
constexpr size_t kMaxWrites = 512;

}  // namespace

template <typename Database>
CommitQueue<Database>::CommitQueue(std::unique_ptr<Database> database, OnCommit on_commit,
                                   FullDisk full_disk)
    : database_(std::move(database)),
      on_commit_(std::move(on_commit)),
      full_disk_(std::move(full_disk)),
      thread_([this] { Serve(); }) {}

template <typename Database>
CommitQueue<Database>::~CommitQueue() {
  const std::lock_guard lock(mutex_);
  ending_ = true;
  submitted_.notify_one();
}

template <typename Database>
void CommitQueue<Database>::Submit(Write write, Done done, const std::string& lane, int64_t bytes,
                                   DiskUse use) {
  const std::lock_guard lock(mutex_);
  std::deque<Item>& queue = lanes_[lane];
  if (queue.empty()) turns_.push_back(lane);
  queue.push_back({std::move(write), std::move(done), bytes, use});
  submitted_.notify_one();
}

template <typename Database>
void CommitQueue<Database>::SubmitLazily(Write write, const std::string& lane) {
  const std::lock_guard lock(mutex_);
  lazy_.emplace_back(lane, std::move(write));
}

template <typename Database>
void CommitQueue<Database>::Flush() {
  std::set<std::string> lanes;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [lane, write] : lazy_) lanes.insert(lane);
  }
  for (const std::string& lane : lanes) {
    Run([](Database&) { return absl::OkStatus(); }, lane).IgnoreError();
  }
}

template <typename Database>
absl::Status CommitQueue<Database>::Run(Write write, const std::string& lane, DiskUse use) {
  std::promise<absl::Status> promise;
  auto outcome = promise.get_future();
  Submit(
      std::move(write), [&](const absl::Status& status) { promise.set_value(status); }, lane, 0,
      use);
  return outcome.get();
}

template <typename Database>
void CommitQueue<Database>::Serve() {
  for (Group group = Take(); !group.writes.empty(); group = Take()) Commit(std::move(group));
}

// Waits for writes and returns them; returns none at the end.
template <typename Database>
typename CommitQueue<Database>::Group CommitQueue<Database>::Take() {
  Group group;
  std::unique_lock lock(mutex_);
  submitted_.wait(lock, [this] { return !turns_.empty() || ending_; });
  TakeTurns(group, /*large=*/!large_before_);
  if (group.writes.empty()) TakeTurns(group, /*large=*/true);
  large_before_ = std::any_of(group.bytes.begin(), group.bytes.end(),
                              [](int64_t bytes) { return bytes > kMaxBytes; });
  TakeLazy(group);
  return group;
}

// Takes one write of each lane at a time, as long as there is room; one larger than a commit only
// if `large` and only once. A lane whose next write has no room keeps its turn.
template <typename Database>
void CommitQueue<Database>::TakeTurns(Group& group, bool large) {
  int64_t bytes = 0;
  size_t passed_over = 0;  // the lanes at the front of turns_ whose next write has no room
  while (passed_over < turns_.size() && group.writes.size() < kMaxWrites) {
    const auto turn = turns_.begin() + static_cast<std::ptrdiff_t>(passed_over);
    const auto lane = lanes_.find(*turn);
    Item& next = lane->second.front();
    const bool is_large = next.bytes > kMaxBytes;
    if (is_large ? !large : bytes + next.bytes > kMaxBytes) {
      ++passed_over;
      continue;
    }
    if (is_large) {
      large = false;
    } else {
      bytes += next.bytes;
    }
    group.Add(std::move(next));
    lane->second.pop_front();
    turns_.erase(turn);
    if (lane->second.empty()) {
      lanes_.erase(lane);
    } else {
      turns_.push_back(lane->first);
    }
  }
}

template <typename Database>
void CommitQueue<Database>::TakeLazy(Group& group) {
  const auto due = std::stable_partition(
      lazy_.begin(), lazy_.end(), [this](const auto& one) { return lanes_.contains(one.first); });
  for (auto one = due; one != lazy_.end(); ++one) {
    group.Add({std::move(one->second), [](const absl::Status&) {}, 0, DiskUse::kNeedsRoom});
  }
  lazy_.erase(due, lazy_.end());
}

// On a full disk, writes that free room are committed without the others, which are refused.
template <typename Database>
void CommitQueue<Database>::Commit(Group group) {
  const absl::Status room = full_disk_.check ? full_disk_.check(*database_) : absl::OkStatus();
  const size_t submitted = group.writes.size();
  if (!room.ok() && RefuseThoseThatNeedRoom(group, room) && on_commit_) {
    on_commit_({submitted - group.writes.size(), {}, room, /*room=*/false});
  }
  if (group.writes.empty()) return;
  const auto begin = std::chrono::steady_clock::now();
  std::vector<absl::Status> outcomes(group.writes.size());
  const absl::Status committed = database_->Commit(group.writes, outcomes);
  if (on_commit_) {
    const auto duration = std::chrono::steady_clock::now() - begin;
    on_commit_({group.writes.size(), duration, committed, room.ok()});
  }
  if (IsDiskFull(committed)) {
    const bool made = full_disk_.make && full_disk_.make();
    // What is left is tried again, since it is less or there is more room; so this ends.
    if (RefuseThoseThatNeedRoom(group, committed) || made) return Commit(std::move(group));
  }
  for (size_t i = 0; i < group.done.size(); ++i) {
    group.done[i](committed.ok() ? outcomes[i] : committed);
  }
}

// Returns whether there were any.
template <typename Database>
bool CommitQueue<Database>::RefuseThoseThatNeedRoom(Group& group, const absl::Status& refusal) {
  Group kept;
  for (size_t i = 0; i < group.writes.size(); ++i) {
    if (group.uses[i] == DiskUse::kNeedsRoom) {
      group.done[i](refusal);
    } else {
      kept.Add(
          {std::move(group.writes[i]), std::move(group.done[i]), group.bytes[i], group.uses[i]});
    }
  }
  std::swap(group, kept);
  return group.writes.size() < kept.writes.size();
}

template class CommitQueue<SqliteDatabase>;
template class CommitQueue<PostgresWriter>;

}  // namespace polyest::internal
