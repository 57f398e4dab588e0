#include "server/sessions/observer_list.h"

#include <absl/strings/str_cat.h>

#include <utility>

namespace polyest::internal {

absl::Status ObserverList::Add(std::shared_ptr<SessionObserver> observer) {
  const std::lock_guard lock(mutex_);
  if (closed_) return absl::NotFoundError(absl::StrCat(session_, " has been deleted"));
  entries_.push_back({std::move(observer), nullptr});
  return absl::OkStatus();
}

void ObserverList::Remove(const SessionObserver* observer) {
  const std::lock_guard lock(mutex_);
  std::erase_if(entries_, [&](const Entry& entry) { return entry.observer.get() == observer; });
}

size_t ObserverList::size() const {
  const std::lock_guard lock(mutex_);
  return entries_.size();
}

std::vector<std::shared_ptr<SessionObserver>> ObserverList::All() const {
  const std::lock_guard lock(mutex_);
  return AllLocked();
}

std::vector<std::shared_ptr<SessionObserver>> ObserverList::AllLocked() const {
  std::vector<std::shared_ptr<SessionObserver>> all;
  for (const Entry& entry : entries_) all.push_back(entry.observer);
  return all;
}

void ObserverList::Announce(SharedEstimate estimate) {
  {
    const std::lock_guard lock(mutex_);
    if (entries_.empty()) return;
    if (waiting_ != nullptr) {
      if (estimate->sequence() >= waiting_->sequence()) waiting_ = std::move(estimate);
      return;
    }
    waiting_ = std::move(estimate);
  }
  // There is one task at a time, and it is never refused.
  strand_->Submit([self = shared_from_this()] { self->PassOn(); }, Admission::kAlways)
      .IgnoreError();
}

void ObserverList::AfterAnnounced(std::function<void()> then) {
  strand_->Submit(std::move(then), Admission::kAlways).IgnoreError();
}

void ObserverList::PassOn() {
  std::vector<std::shared_ptr<SessionObserver>> due;
  SharedEstimate estimate;
  {
    const std::lock_guard lock(mutex_);
    estimate = std::exchange(waiting_, nullptr);
    for (Entry& entry : entries_) {
      if (entry.told == estimate) continue;
      if (entry.told != nullptr && entry.told->sequence() > estimate->sequence()) continue;
      entry.told = estimate;
      due.push_back(entry.observer);
    }
  }
  for (const auto& observer : due) observer->OnEstimate(estimate);
}

std::vector<std::shared_ptr<SessionObserver>> ObserverList::Close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  std::vector<std::shared_ptr<SessionObserver>> all = AllLocked();
  entries_.clear();
  return all;
}

}  // namespace polyest::internal
