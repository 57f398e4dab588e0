#include "server/sessions/writer_lease.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {

absl::Status WriterLease::Claim(std::shared_ptr<SessionObserver> writer, const std::string& id) {
  std::shared_ptr<SessionObserver> replaced;
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return absl::NotFoundError(absl::StrCat(session_, " has been deleted"));
    if (writer_ != nullptr && (id.empty() || id != id_)) {
      return Refuse(absl::StatusCode::kAborted,
                    absl::StrCat(session_, " has a writer already; one at a time"),
                    {.reason = kAnotherWriter});
    }
    replaced = std::exchange(writer_, std::move(writer));
    id_ = id;
  }
  if (replaced != nullptr) replaced->OnReplaced();
  return absl::OkStatus();
}

bool WriterLease::Release(const SessionObserver* writer) {
  std::shared_ptr<SessionObserver> released;  // destroyed after the lock
  const std::lock_guard lock(mutex_);
  if (writer_ == nullptr || writer_.get() != writer) return false;
  released.swap(writer_);
  return true;
}

std::shared_ptr<SessionObserver> WriterLease::writer() const {
  const std::lock_guard lock(mutex_);
  return writer_;
}

bool WriterLease::is_held() const {
  const std::lock_guard lock(mutex_);
  return writer_ != nullptr;
}

std::shared_ptr<SessionObserver> WriterLease::Close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  return writer_;
}

}  // namespace polyest::internal
