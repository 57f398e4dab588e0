#include "server/web/shared_watch.h"

#include <exception>
#include <utility>

#include "core/common/check.h"
#include "polyest/v1/session_service.pb.h"
#include "server/service/status_mapping.h"

namespace polyest::internal {
namespace {

constexpr int kNoClient = -1;
// Largest prediction that is kept for clients who come later, bytes: it may have millions of
// numbers.
constexpr size_t kLargest = size_t{64} << 10;

}  // namespace

void LatestEvents::Put(Kind kind, EventSource::Text event) {
  Remove(kind);
  events_.emplace_back(kind, std::move(event));
}

void LatestEvents::Remove(Kind kind) {
  std::erase_if(events_, [&](const auto& entry) { return entry.first == kind; });
}

EventSource::Text LatestEvents::Take() {
  POLYEST_CHECK(!events_.empty());
  EventSource::Text event = std::move(events_.front().second);
  events_.erase(events_.begin());
  return event;
}

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

void SharedWatch::Add(WatchEvents& client) {
  const std::lock_guard lock(mutex_);
  client.Give(latest_);
  if (status_) client.End(*status_);
  clients_.insert(&client);
}

void SharedWatch::Remove(WatchEvents& client) {
  const std::lock_guard lock(mutex_);
  clients_.erase(&client);
}

void SharedWatch::Read() {
  grpc::Status status;
  try {
    status = ReadAll();
  } catch (const std::exception&) {
    // Want of memory ends this watch only.
    status = grpc::Status(grpc::StatusCode::INTERNAL, "unexpected error");
  }
  const std::lock_guard lock(mutex_);
  status_ = status;
  for (WatchEvents* const client : clients_) client->End(status);
}

grpc::Status SharedWatch::ReadAll() {
  while (call_.Await(kNoClient, WebCall::Clock::now() + WebCall::kForever) ==
         WebCall::Event::kMessage) {
    const std::string bytes = call_.TakeMessage();
    v1::WatchSessionResponse response;
    const auto event = ToEvent(bytes, *response.GetDescriptor());
    if (!event.ok()) return ToGrpc(event.status());
    POLYEST_CHECK(response.ParseFromString(bytes));  // as ToEvent has done
    Publish(
        response.has_prediction() ? LatestEvents::Kind::kPrediction : LatestEvents::Kind::kEstimate,
        *event);
  }
  return call_.status();
}

void SharedWatch::Publish(LatestEvents::Kind kind, const EventSource::Text& event) {
  const std::lock_guard lock(mutex_);
  if (kind == LatestEvents::Kind::kPrediction && event->size() > kLargest) {
    latest_.Remove(kind);
  } else {
    latest_.Put(kind, event);
  }
  for (WatchEvents* const client : clients_) client->Give(kind, event);
}

WatchEvents::WatchEvents(std::shared_ptr<SharedWatch> watch) : watch_(std::move(watch)) {
  watch_->Add(*this);
}

WatchEvents::~WatchEvents() { watch_->Remove(*this); }

void WatchEvents::Give(const LatestEvents& events) {
  const std::lock_guard lock(mutex_);
  events_ = events;
}

void WatchEvents::Give(LatestEvents::Kind kind, const Text& event) {
  {
    const std::lock_guard lock(mutex_);
    events_.Put(kind, event);
  }
  wake_up_.Signal();
}

void WatchEvents::End(const grpc::Status& status) {
  {
    const std::lock_guard lock(mutex_);
    status_ = status;
  }
  wake_up_.Signal();
}

WebCall::Event WatchEvents::Await(int client, WebCall::Clock::time_point deadline) {
  const auto look = [this]() -> std::optional<WebCall::Event> {
    const std::lock_guard lock(mutex_);
    wake_up_.Clear();
    if (!events_.empty()) return WebCall::Event::kMessage;
    if (status_) return WebCall::Event::kEnd;
    return std::nullopt;
  };
  return WebCall::AwaitEvent(wake_up_, client, deadline, look);
}

EventSource::Text WatchEvents::Take() {
  const std::lock_guard lock(mutex_);
  return events_.Take();
}

grpc::Status WatchEvents::status() const {
  const std::lock_guard lock(mutex_);
  return *status_;
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

std::shared_ptr<WatchEvents> SharedWatches::Join(const Key& key, const WebCall::Request& request) {
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
