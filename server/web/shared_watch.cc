#include "server/web/shared_watch.h"

#include <chrono>
#include <exception>
#include <utility>

#include "core/common/check.h"
#include "polyest/v1/session_service.pb.h"

namespace polyest::internal {
namespace {

constexpr int kNoClient = -1;
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
  WakeAll();
}

grpc::Status SharedWatch::ReadAll() {
  while (call_.Await(kNoClient, WebCall::Clock::now() + kForever) == WebCall::Event::kMessage) {
    const std::string bytes = call_.TakeMessage();
    EventSource::Text event = ToEvent(bytes, *v1::WatchSessionResponse::descriptor());
    v1::WatchSessionResponse response;
    POLYEST_CHECK(response.ParseFromString(bytes));
    {
      const std::lock_guard lock(mutex_);
      last_[response.has_prediction() ? kPrediction : kEstimate] = {std::move(event), ++count_};
    }
    WakeAll();
  }
  return call_.status();
}

void SharedWatch::WakeAll() {
  const std::lock_guard lock(clients_mutex_);
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
    if (last.number == taken_[kind]) continue;
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
  taken_[next - watch_->last_.data()] = next->number;
  return next->event;
}

grpc::Status WatchEvents::status() const {
  const std::lock_guard lock(watch_->mutex_);
  return *watch_->status_;
}

std::shared_ptr<EventSource> SharedWatches::Join(Key key, const WebCall::Request& request) {
  const std::lock_guard lock(mutex_);
  std::erase_if(watches_, [](const auto& entry) { return entry.second.expired(); });
  std::weak_ptr<SharedWatch>& known = watches_[std::move(key)];
  std::shared_ptr<SharedWatch> watch = known.lock();
  if (watch == nullptr || watch->ended()) {
    known = watch = std::make_shared<SharedWatch>(channel_, request);
  }
  return std::make_shared<WatchEvents>(std::move(watch));
}

}  // namespace polyest::internal
