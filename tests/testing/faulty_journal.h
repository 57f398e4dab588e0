#pragma once

// A session journal that can behave as if its disk were slow, full or broken.

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "server/journal/memory_journal.h"

namespace polyest::internal {

class FaultyJournal final : public SessionJournal {
 public:
  // Lets all further batches wait for Release.
  void Hold() {
    const std::lock_guard lock(mutex_);
    holding_ = true;
  }
  // Stores the waiting batches in order, and further ones at once.
  void Release() {
    std::deque<std::pair<JournalEntry, Done>> held;
    {
      const std::lock_guard lock(mutex_);
      holding_ = false;
      held.swap(held_);
    }
    for (auto& [entry, done] : held) Append(std::move(entry), std::move(done));
  }
  // Lets the storing of batches and the creating and deleting of sessions fail with `status` from
  // now on; OK ends the failures.
  void Fail(const absl::Status& status) {
    const std::lock_guard lock(mutex_);
    failure_ = status;
  }

  // Acts as a journal that daemons share.
  void Share(SharedJournal* shared) { shared_ = shared; }

  // Calls `then` once the journal has deleted a session, before the caller hears of it.
  void AfterDeleting(std::function<void()> then) {
    const std::lock_guard lock(mutex_);
    then_ = std::move(then);
  }

  bool durable() const override { return true; }
  SharedJournal* shared() override { return shared_; }
  absl::StatusOr<std::vector<SessionHead>> Heads() const override { return journal_.Heads(); }
  absl::StatusOr<int64_t> Create(const SessionHead& head, const v1::Problem& problem,
                                 bool hidden) override {
    if (const absl::Status failed = failure(); !failed.ok()) return failed;
    return journal_.Create(head, problem, hidden);
  }
  absl::Status Show(int64_t session) override { return journal_.Show(session); }
  absl::Status Delete(int64_t session) override {
    if (const absl::Status failed = failure(); !failed.ok()) return failed;
    const absl::Status deleted = journal_.Delete(session);
    if (const auto then = TakeThen()) then();
    return deleted;
  }
  void Append(JournalEntry entry, Done done) override {
    {
      const std::lock_guard lock(mutex_);
      if (holding_) {
        held_.emplace_back(std::move(entry), std::move(done));
        return;
      }
    }
    if (const absl::Status failed = failure(); !failed.ok()) return done(failed);
    journal_.Append(std::move(entry), std::move(done));
  }
  void SaveSnapshot(int64_t session, JournalSnapshot snapshot) override {
    journal_.SaveSnapshot(session, std::move(snapshot));
  }
  void SaveHistoryPoint(int64_t session, JournalHistoryPoint point, int64_t stride) override {
    journal_.SaveHistoryPoint(session, std::move(point), stride);
  }
  absl::StatusOr<v1::Problem> ReadProblem(int64_t session) const override {
    return journal_.ReadProblem(session);
  }
  absl::Status ReadBatches(
      int64_t session, int64_t after,
      const std::function<absl::Status(const JournalBatch&)>& take) const override {
    return journal_.ReadBatches(session, after, take);
  }
  absl::StatusOr<std::string> ReadDigest(int64_t session, int64_t sequence) const override {
    return journal_.ReadDigest(session, sequence);
  }
  absl::StatusOr<std::optional<JournalSnapshot>> ReadSnapshot(int64_t session) const override {
    return journal_.ReadSnapshot(session);
  }
  absl::StatusOr<std::vector<JournalHistoryPoint>> ReadHistory(int64_t session) const override {
    return journal_.ReadHistory(session);
  }

 private:
  absl::Status failure() const {
    const std::lock_guard lock(mutex_);
    return failure_;
  }

  std::function<void()> TakeThen() {
    const std::lock_guard lock(mutex_);
    return std::exchange(then_, nullptr);
  }

  MemoryJournal journal_;
  mutable std::mutex mutex_;
  bool holding_ = false;
  std::deque<std::pair<JournalEntry, Done>> held_;
  absl::Status failure_;
  std::function<void()> then_;
  SharedJournal* shared_ = nullptr;
};

}  // namespace polyest::internal
