#include "server/service/open_calls.h"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <utility>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {

namespace {

// Time after which another stream may have ended, or another daemon may serve.
constexpr std::chrono::seconds kRetryDelay{1};

}  // namespace

absl::Status ShuttingDown() {
  return Refuse(absl::StatusCode::kUnavailable, "the daemon is shutting down",
                {.reason = kShuttingDown, .retry_delay = kRetryDelay});
}

absl::StatusOr<std::unique_ptr<OpenCalls::Ticket>> OpenCalls::Enter(
    Kind kind, std::weak_ptr<Drainable> stream) {
  std::lock_guard lock(mutex_);
  if (draining_) return ShuttingDown();
  if (kind != Kind::kUnary) {
    if (open(kind) >= kMaxStreams) {
      return Refuse(absl::StatusCode::kResourceExhausted,
                    absl::StrCat("the daemon serves at most ", kMaxStreams, " streams at a time"),
                    {.reason = kBusy, .retry_delay = kRetryDelay});
    }
    auto& streams = streams_[static_cast<int>(kind)];
    // Streams that ended are removed when they outnumber the others.
    if (streams.size() > 2 * static_cast<size_t>(open(kind)) + 8) {
      std::erase_if(streams, [](const auto& one) { return one.expired(); });
    }
    streams.push_back(std::move(stream));
  }
  ++open(kind);
  return std::make_unique<Ticket>(*this, kind);
}

void OpenCalls::Leave(Kind kind) {
  std::lock_guard lock(mutex_);
  --open(kind);
  left_.notify_all();
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

void OpenCalls::Drain(std::chrono::steady_clock::time_point deadline) {
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
  left_.wait_until(lock, deadline, [this] { return open(Kind::kWatcher) == 0; });
}

}  // namespace polyest::internal
