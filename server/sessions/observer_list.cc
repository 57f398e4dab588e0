#include "server/sessions/observer_list.h"

#include <absl/strings/str_cat.h>

#include <utility>

namespace polyest::internal {

absl::Status ObserverList::Add(std::shared_ptr<SessionObserver> observer) {
  const std::lock_guard lock(mutex_);
  if (closed_) return absl::NotFoundError(absl::StrCat(session_, " has been deleted"));
  observers_.push_back(std::move(observer));
  return absl::OkStatus();
}

void ObserverList::Remove(const SessionObserver* observer) {
  const std::lock_guard lock(mutex_);
  std::erase_if(observers_, [&](const auto& one) { return one.get() == observer; });
}

size_t ObserverList::size() const {
  const std::lock_guard lock(mutex_);
  return observers_.size();
}

std::vector<std::shared_ptr<SessionObserver>> ObserverList::All() const {
  const std::lock_guard lock(mutex_);
  return observers_;
}

void ObserverList::OnEstimate(const SharedEstimate& estimate) const {
  for (const auto& observer : All()) observer->OnEstimate(estimate);
}

std::vector<std::shared_ptr<SessionObserver>> ObserverList::Close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  return std::exchange(observers_, {});
}

}  // namespace polyest::internal
