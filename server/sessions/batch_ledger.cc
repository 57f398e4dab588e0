#include "server/sessions/batch_ledger.h"

#include <absl/strings/str_format.h>

#include <chrono>
#include <future>
#include <memory>
#include <utility>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Interval between two looks at the stop request.
constexpr std::chrono::milliseconds kLook{20};

}  // namespace

SessionPlace BatchLedger::kept() const {
  const std::lock_guard lock(mutex_);
  return kept_;
}

SessionPlace BatchLedger::taken() const {
  const std::lock_guard lock(mutex_);
  return taken_;
}

bool BatchLedger::all_kept() const {
  const std::lock_guard lock(mutex_);
  return under_way_.empty();
}

uint64_t BatchLedger::losses() const {
  const std::lock_guard lock(mutex_);
  return losses_;
}

absl::StatusOr<BatchLedger::Kind> BatchLedger::Check(
    int64_t sequence, const std::string& digest, uint64_t losses,
    const std::function<absl::StatusOr<std::string>(int64_t)>& kept_digest) const {
  int64_t next = 0;
  std::string known;
  {
    const std::lock_guard lock(mutex_);
    if (losses != losses_) return last_loss_;
    next = taken_.sequence + 1;
    if (sequence > kept_.sequence && sequence < next) {
      known = under_way_[static_cast<size_t>(sequence - kept_.sequence - 1)].digest;
    }
  }
  if (sequence == next) return Kind::kNext;
  if (sequence < 1) {
    return InvalidField(
        "sequence", absl::StrFormat("%d must be at least 1; the next batch is %d", sequence, next));
  }
  if (sequence > next) {
    return absl::FailedPreconditionError(
        absl::StrFormat("sequence: %d leaves a gap; the next batch must be %d", sequence, next));
  }
  if (known.empty()) {
    POLYEST_ASSIGN_OR_RETURN(known, kept_digest(sequence));
  }
  if (known == digest) return Kind::kRepeat;
  return absl::AlreadyExistsError(absl::StrFormat(
      "sequence: %d was taken with other measurements; the next batch must be %d", sequence, next));
}

absl::Status BatchLedger::Take(const SessionPlace& place, std::string digest, uint64_t losses) {
  const std::lock_guard lock(mutex_);
  if (losses != losses_) return last_loss_;
  POLYEST_CHECK(place.sequence == taken_.sequence + 1);
  under_way_.push_back({place, std::move(digest)});
  taken_ = place;
  return absl::OkStatus();
}

void BatchLedger::Settle(uint64_t losses, int64_t sequence, const absl::Status& kept) {
  std::multimap<int64_t, Done> settled;
  {
    const std::lock_guard lock(mutex_);
    if (losses != losses_) return;  // the batch is lost already, with one before it
    POLYEST_CHECK(!under_way_.empty() && under_way_.front().place.sequence == sequence);
    if (kept.ok()) {
      kept_ = under_way_.front().place;
      under_way_.pop_front();
      const auto end = waiting_.upper_bound(sequence);
      while (waiting_.begin() != end) settled.insert(waiting_.extract(waiting_.begin()));
    } else {
      ++losses_;
      last_loss_ = kept;
      taken_ = kept_;
      under_way_.clear();
      settled.swap(waiting_);
    }
  }
  for (const auto& [waited_for, done] : settled) done(kept);
}

void BatchLedger::Restart(const SessionPlace& place, bool anew) {
  std::multimap<int64_t, Done> lost;
  absl::Status loss;
  {
    const std::lock_guard lock(mutex_);
    loss = RestartLocked(place, anew, lost);
  }
  for (const auto& [waited_for, done] : lost) done(loss);
}

absl::Status BatchLedger::RestartLocked(const SessionPlace& place, bool anew,
                                        std::multimap<int64_t, Done>& lost) {
  kept_ = taken_ = place;
  if (under_way_.empty() && !anew) return absl::OkStatus();
  ++losses_;
  last_loss_ = absl::UnavailableError(
      "the session has been taken anew from the journal; send what was not acknowledged again");
  under_way_.clear();
  lost.swap(waiting_);
  return last_loss_;
}

void BatchLedger::Follow(const SessionPlace& place, bool anew) {
  std::multimap<int64_t, Done> lost;
  absl::Status loss;
  {
    const std::lock_guard lock(mutex_);
    if (place.sequence <= kept_.sequence || !under_way_.empty()) return;
    loss = RestartLocked(place, anew, lost);
  }
  for (const auto& [waited_for, done] : lost) done(loss);
}

void BatchLedger::WhenKept(int64_t sequence, uint64_t losses, Done done) {
  absl::Status now;
  {
    const std::lock_guard lock(mutex_);
    if (losses != losses_) {
      now = last_loss_;
    } else if (sequence > kept_.sequence) {
      waiting_.emplace(sequence, std::move(done));
      return;
    }
  }
  done(now);
}

absl::Status BatchLedger::AwaitKept(int64_t sequence, uint64_t losses, const Stop& stop) {
  // The batch may be settled after this has given up.
  const auto kept = std::make_shared<std::promise<absl::Status>>();
  auto outcome = kept->get_future();
  WhenKept(sequence, losses, [kept](const absl::Status& status) { kept->set_value(status); });
  while (outcome.wait_for(kLook) != std::future_status::ready) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
  }
  return outcome.get();
}

void BatchLedger::WhenAllKept(uint64_t losses, Done done) {
  absl::Status now;
  {
    const std::lock_guard lock(mutex_);
    if (losses != losses_) {
      now = last_loss_;
    } else if (taken_.sequence > kept_.sequence) {
      waiting_.emplace(taken_.sequence, std::move(done));
      return;
    }
  }
  done(now);
}

}  // namespace polyest::internal
