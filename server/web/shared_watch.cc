#include "server/web/shared_watch.h"

#include <chrono>
#include <exception>
#include <utility>

#include "core/common/check.h"
#include "polyest/v1/session_service.pb.h"

namespace polyest::internal {
namespace {

constexpr int kNoClient = -1;
// Size of an event that is not kept for clients who come later, bytes.
constexpr size_t kLargest = size_t{64} << 10;
// The call ends when its last client goes.
constexpr std::chrono::hours kForever{24 * 365};

}  // namespace

SharedWatch::SharedWatch(const std::shared_ptr<grpc::Channel>& channel,
                         const WebCall::Request& request)
    : call_(channel, request), reader_([this] { Read(); }) {}

SharedWatch::~SharedWatch() {
  call_.Cancel();
  reader_.join();
}

bool SharedWatch::ended() const {
  const std::lock_guard lock(mutex_);
  return status_.has_value();
}

void SharedWatch::Read() {
  grpc::Status status;
  try {
    status = ReadAll();
  } catch (const std::exception&) {
    // Want of memory ends this watch only.
    status = grpc::Status(grpc::StatusCode::INTERNAL, "unexpected error");
  }
  {
    const std::lock_guard lock(mutex_);
    status_ = status;
  }
  const std::lock_guard lock(clients_mutex_);
  WakeAll();
}

grpc::Status SharedWatch::ReadAll() {
  while (call_.Await(kNoClient, WebCall::Clock::now() + kForever) == WebCall::Event::kMessage) {
    const std::string bytes = call_.TakeMessage();
    EventSource::Text event = ToEvent(bytes, *v1::WatchSessionResponse::descriptor());
    v1::WatchSessionResponse response;
    POLYEST_CHECK(response.ParseFromString(bytes));
    Publish(response.has_prediction() ? kPrediction : kEstimate, std::move(event));
  }
  return call_.status();
}

void SharedWatch::Publish(Kind kind, EventSource::Text event) {
  const std::lock_guard lock(clients_mutex_);
  {
    const std::lock_guard lock_messages(mutex_);
    last_[kind] = {std::move(event), ++count_, clients_.size()};
  }
  WakeAll();
}

void SharedWatch::WakeAll() const {
  for (const WakeUp* const client : clients_) client->Signal();
}

WatchEvents::WatchEvents(std::shared_ptr<SharedWatch> watch) : watch_(std::move(watch)) {
  const std::lock_guard lock(watch_->clients_mutex_);
  watch_->clients_.insert(&wake_up_);
}

WatchEvents::~WatchEvents() {
  const std::lock_guard lock(watch_->clients_mutex_);
  watch_->clients_.erase(&wake_up_);
}

const SharedWatch::Message* WatchEvents::Next() const {
  const SharedWatch::Message* next = nullptr;
  for (int kind = 0; kind < SharedWatch::kKinds; ++kind) {
    const SharedWatch::Message& last = watch_->last_[kind];
    if (last.event == nullptr || last.number == taken_[kind]) continue;
    if (next == nullptr || last.number < next->number) next = &last;
  }
  return next;
}

WebCall::Event WatchEvents::Await(int client, WebCall::Clock::time_point deadline) {
  while (true) {
    {
      const std::lock_guard lock(watch_->mutex_);
      wake_up_.Clear();
      if (Next() != nullptr) return WebCall::Event::kMessage;
      if (watch_->status_) return WebCall::Event::kEnd;
    }
    switch (wake_up_.Await(client, deadline)) {
      case WakeUp::Reason::kSignal:
        break;
      case WakeUp::Reason::kClientGone:
        return WebCall::Event::kClientGone;
      case WakeUp::Reason::kTimeout:
        return WebCall::Event::kTimeout;
    }
  }
}

EventSource::Text WatchEvents::Take() {
  const std::lock_guard lock(watch_->mutex_);
  const SharedWatch::Message* const next = Next();
  POLYEST_CHECK(next != nullptr);
  const auto kind = next - watch_->last_.data();
  taken_[static_cast<size_t>(kind)] = next->number;
  SharedWatch::Message& message = watch_->last_[static_cast<size_t>(kind)];
  const bool taken_by_all = message.waiting <= 1;
  if (!taken_by_all) --message.waiting;
  // Predictions may have millions of numbers.
  if (taken_by_all && message.event->size() > kLargest) return std::move(message.event);
  return message.event;
}

grpc::Status WatchEvents::status() const {
  const std::lock_guard lock(watch_->mutex_);
  return *watch_->status_;
}

std::shared_ptr<SharedWatch> SharedWatches::Find(const Key& key) const {
  const auto found = watches_.find(key);
  std::shared_ptr<SharedWatch> watch;
  if (found != watches_.end()) watch = found->second.lock();
  return watch == nullptr || watch->ended() ? nullptr : watch;
}

bool SharedWatches::IsOpen(const Key& key) const {
  const std::lock_guard lock(mutex_);
  return Find(key) != nullptr;
}

std::shared_ptr<EventSource> SharedWatches::Join(const Key& key, const WebCall::Request& request) {
  const std::lock_guard lock(mutex_);
  std::erase_if(watches_, [](const auto& entry) { return entry.second.expired(); });
  std::shared_ptr<SharedWatch> watch = Find(key);
  if (watch == nullptr) {
    watch = std::make_shared<SharedWatch>(channel_, request);
    watches_[key] = watch;
  }
  return std::make_shared<WatchEvents>(std::move(watch));
}

}  // namespace polyest::internal
