#include "server/journal/commit_queue.h"

#include <algorithm>
#include <future>
#include <set>
#include <utility>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Largest number of writes in one commit. It bounds what has to be written again when the commit
// fails, and how long others wait for it.
constexpr size_t kMaxWrites = 512;

bool ConcernsOnlyItself(const absl::Status& status) {
  return absl::IsNotFound(status) || absl::IsAlreadyExists(status) ||
         absl::IsFailedPrecondition(status);
}

}  // namespace

CommitQueue::CommitQueue(std::unique_ptr<SqliteDatabase> database, OnCommit on_commit,
                         CommitRoom room)
    : database_(std::move(database)),
      on_commit_(std::move(on_commit)),
      room_(std::move(room)),
      thread_([this] { Serve(); }) {}

CommitQueue::~CommitQueue() {
  const std::lock_guard lock(mutex_);
  ending_ = true;
  submitted_.notify_one();
}

void CommitQueue::Submit(Write write, Done done, const std::string& lane, int64_t bytes,
                         DiskUse use) {
  const std::lock_guard lock(mutex_);
  std::deque<Item>& queue = lanes_[lane];
  if (queue.empty()) turns_.push_back(lane);
  queue.push_back({std::move(write), std::move(done), bytes, use});
  submitted_.notify_one();
}

void CommitQueue::SubmitLazily(Write write, const std::string& lane) {
  const std::lock_guard lock(mutex_);
  lazy_.emplace_back(lane, std::move(write));
}

void CommitQueue::Flush() {
  std::set<std::string> lanes;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [lane, write] : lazy_) lanes.insert(lane);
  }
  for (const std::string& lane : lanes) {
    Run([](SqliteDatabase&) { return absl::OkStatus(); }, lane).IgnoreError();
  }
}

absl::Status CommitQueue::Run(Write write, const std::string& lane, DiskUse use) {
  std::promise<absl::Status> promise;
  auto outcome = promise.get_future();
  Submit(
      std::move(write), [&](const absl::Status& status) { promise.set_value(status); }, lane, 0,
      use);
  return outcome.get();
}

void CommitQueue::Serve() {
  for (auto items = Take(); !items.empty(); items = Take()) Commit(std::move(items));
}

// Waits for writes and returns them; returns none at the end.
std::vector<CommitQueue::Item> CommitQueue::Take() {
  std::vector<Item> items;
  std::unique_lock lock(mutex_);
  submitted_.wait(lock, [this] { return !turns_.empty() || ending_; });
  TakeTurns(items, /*large=*/!large_before_);
  if (items.empty()) TakeTurns(items, /*large=*/true);
  large_before_ = std::any_of(items.begin(), items.end(),
                              [](const Item& item) { return item.bytes > kMaxBytes; });
  TakeLazy(items);
  return items;
}

// Takes one write of each lane at a time, as long as there is room; one larger than a commit only
// if `large` and only once. A lane whose next write has no room keeps its turn.
void CommitQueue::TakeTurns(std::vector<Item>& items, bool large) {
  int64_t bytes = 0;
  size_t passed_over = 0;  // the lanes at the front of turns_ whose next write has no room
  while (passed_over < turns_.size() && items.size() < kMaxWrites) {
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
    items.push_back(std::move(next));
    lane->second.pop_front();
    turns_.erase(turn);
    if (lane->second.empty()) {
      lanes_.erase(lane);
    } else {
      turns_.push_back(lane->first);
    }
  }
}

void CommitQueue::TakeLazy(std::vector<Item>& items) {
  const auto due = std::stable_partition(
      lazy_.begin(), lazy_.end(), [this](const auto& one) { return lanes_.contains(one.first); });
  for (auto one = due; one != lazy_.end(); ++one) {
    items.push_back({std::move(one->second), [](const absl::Status&) {}, 0});
  }
  lazy_.erase(due, lazy_.end());
}

// On a full disk, writes that free room are committed without the others, which are refused.
void CommitQueue::Commit(std::vector<Item> items) {
  const absl::Status room = room_.check ? room_.check(*database_) : absl::OkStatus();
  const size_t submitted = items.size();
  if (!room.ok() && RefuseThoseThatNeedRoom(items, room) && on_commit_) {
    on_commit_({submitted - items.size(), {}, room, /*room=*/false});
  }
  if (items.empty()) return;
  const auto begin = std::chrono::steady_clock::now();
  std::vector<absl::Status> outcomes(items.size());
  const absl::Status committed = WriteAll(items, outcomes);
  if (!committed.ok()) database_->Execute("ROLLBACK").IgnoreError();
  if (on_commit_) {
    const auto duration = std::chrono::steady_clock::now() - begin;
    on_commit_({items.size(), duration, committed, room.ok()});
  }
  if (IsDiskFull(committed)) {
    const bool made = room_.make && room_.make();
    // What is left is tried again, since it is less or there is more room; so this ends.
    if (RefuseThoseThatNeedRoom(items, committed) || made) return Commit(std::move(items));
  }
  for (size_t i = 0; i < items.size(); ++i) {
    items[i].done(committed.ok() ? outcomes[i] : committed);
  }
}

// Returns whether there were any.
bool CommitQueue::RefuseThoseThatNeedRoom(std::vector<Item>& items, const absl::Status& refusal) {
  const auto needing = std::stable_partition(
      items.begin(), items.end(), [](const Item& item) { return item.use == DiskUse::kFreesRoom; });
  const bool any = needing != items.end();
  for (auto item = needing; item != items.end(); ++item) item->done(refusal);
  items.erase(needing, items.end());
  return any;
}

absl::Status CommitQueue::WriteAll(const std::vector<Item>& items,
                                   std::vector<absl::Status>& outcomes) {
  POLYEST_RETURN_IF_ERROR(database_->Execute("BEGIN IMMEDIATE"));
  for (size_t i = 0; i < items.size(); ++i) {
    outcomes[i] = items[i].write(*database_);
    if (!outcomes[i].ok() && !ConcernsOnlyItself(outcomes[i])) return outcomes[i];
  }
  return database_->Execute("COMMIT");
}

}  // namespace polyest::internal
