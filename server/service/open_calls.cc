#include "server/service/open_calls.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "core/common/status.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {

namespace {

// Time after which another stream may have ended, or another daemon may serve.
constexpr std::chrono::seconds kRetryDelay{1};

absl::Status Full(const std::string& why) {
  return Refuse(absl::StatusCode::kResourceExhausted, why,
                {.reason = kBusy, .retry_delay = kRetryDelay});
}

absl::Status Unread(int64_t bytes) {
  return Full(absl::StrCat("the tenant's clients have left answers of ", bytes >> 20,
                           " MiB unread; read them first"));
}

}  // namespace

absl::Status ShuttingDown() {
  return Refuse(absl::StatusCode::kUnavailable, "the daemon is shutting down",
                {.reason = kShuttingDown, .retry_delay = kRetryDelay});
}

absl::Status Moving() {
  return Refuse(absl::StatusCode::kUnavailable,
                "the session moves to another daemon; ask for it again",
                {.reason = kOwnedElsewhere, .retry_delay = std::chrono::milliseconds(100)});
}

absl::Status OpenCalls::CheckMayEnter(Kind kind, const std::string& tenant) const {
  const auto share = shares_.find(tenant);
  const auto place = static_cast<size_t>(kind);
  if (kind == Kind::kUnary) {
    if (share == shares_.end() || share->second.answer_bytes < kMaxUnreadBytes) {
      return absl::OkStatus();
    }
    return Unread(share->second.answer_bytes);
  }
  if (open_[place] >= kMaxStreams) {
    return Full(absl::StrCat("the daemon serves at most ", kMaxStreams, " streams at a time"));
  }
  if (share != shares_.end() && share->second.open[place] >= kMaxStreamsOfTenant) {
    return Full(absl::StrCat("the daemon serves at most ", kMaxStreamsOfTenant,
                             " streams of a tenant at a time"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<OpenCalls::Ticket>> OpenCalls::Enter(
    Kind kind, const std::string& tenant, std::weak_ptr<Drainable> stream) {
  std::lock_guard lock(mutex_);
  if (draining_) return ShuttingDown();
  POLYEST_RETURN_IF_ERROR(CheckMayEnter(kind, tenant));
  if (kind != Kind::kUnary) {
    auto& streams = streams_[static_cast<int>(kind)];
    // Streams that ended are removed when they outnumber the others.
    if (streams.size() > 2 * static_cast<size_t>(open(kind)) + 8) {
      std::erase_if(streams, [](const auto& one) { return one.expired(); });
    }
    streams.push_back(std::move(stream));
  }
  ++open(kind);
  ++shares_[tenant].open[static_cast<int>(kind)];
  return std::make_unique<Ticket>(*this, kind, tenant);
}

void OpenCalls::Leave(const Ticket& ticket) {
  std::lock_guard lock(mutex_);
  --open(ticket.kind_);
  const auto share = shares_.find(ticket.tenant_);
  --share->second.open[static_cast<int>(ticket.kind_)];
  share->second.answer_bytes -= ticket.answer_bytes_;
  const auto& left = share->second.open;
  if (std::all_of(std::begin(left), std::end(left), [](int open) { return open == 0; })) {
    shares_.erase(share);
  }
  left_.notify_all();
}

absl::Status OpenCalls::Ticket::HoldAnswer(int64_t bytes) {
  const std::lock_guard lock(calls_.mutex_);
  if (bytes <= answer_bytes_) return absl::OkStatus();
  int64_t& unread = calls_.shares_[tenant_].answer_bytes;
  const int64_t of_others = unread - answer_bytes_;
  if (bytes > kSmallAnswer && of_others > 0 && bytes > kMaxUnreadBytes - of_others) {
    return Unread(unread);
  }
  answer_bytes_ = bytes;
  unread = of_others + bytes;
  return absl::OkStatus();
}

int OpenCalls::Count(Kind kind) const {
  const std::lock_guard lock(mutex_);
  return open_[static_cast<int>(kind)];
}

void OpenCalls::DrainKind(Kind kind) {
  std::vector<std::weak_ptr<Drainable>> streams;
  {
    std::lock_guard lock(mutex_);
    streams.swap(streams_[static_cast<int>(kind)]);
  }
  for (const auto& stream : streams) {
    if (auto open_stream = stream.lock()) open_stream->Drain();
  }
}

bool OpenCalls::Drain(std::chrono::steady_clock::time_point deadline) {
  {
    std::lock_guard lock(mutex_);
    draining_ = true;
  }
  DrainKind(Kind::kWriter);
  {
    // The watchers end after the writers, so that they see the writers' last estimates.
    std::unique_lock lock(mutex_);
    left_.wait_until(lock, deadline,
                     [this] { return open(Kind::kUnary) + open(Kind::kWriter) == 0; });
  }
  DrainKind(Kind::kWatcher);
  std::unique_lock lock(mutex_);
  return left_.wait_until(lock, deadline, [this] {
    return open(Kind::kUnary) + open(Kind::kWriter) + open(Kind::kWatcher) == 0;
  });
}

}  // namespace polyest::internal
