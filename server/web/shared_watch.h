#pragma once

// Watches a session once for all HTTP clients that ask alike: with the same request, the same token
// and the same certificate. A call for each of them would cost many times what the estimates do.

#include <grpcpp/channel.h>

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/web/event_source.h"
#include "server/web/wake_up.h"
#include "server/web/web_call.h"

namespace polyest::internal {

// One watch. As in a watch of one's own, a slow client misses estimates but never the last one.
// Whoever comes later gets the last estimate that was made, which need not be of the last batch.
class SharedWatch {
 public:
  // Starts the call, which must be one of WatchSession.
  SharedWatch(const std::shared_ptr<grpc::Channel>& channel, const WebCall::Request& request);
  // Cancels the call.
  ~SharedWatch();
  SharedWatch(const SharedWatch&) = delete;
  SharedWatch& operator=(const SharedWatch&) = delete;

  // Returns whether the call has ended.
  bool ended() const;

 private:
  friend class WatchEvents;

  // The last estimate or the last prediction, as an event.
  struct Message {
    EventSource::Text event;  // null if it was large and has been taken
    int64_t number = 0;       // among all messages of the watch, from 1; 0: none yet
    size_t waiting = 0;       // clients that have not taken it
  };
  enum Kind { kEstimate, kPrediction, kKinds };

  // Keeps a message and wakes all clients.
  void Publish(Kind kind, EventSource::Text event);
  // Takes the call's messages until it ends. Runs on the watch's own thread.
  void Read();
  // The same; returns how the call has ended.
  grpc::Status ReadAll();
  // Called with the mutex of the clients held.
  void WakeAll() const;

  WebCall call_;
  mutable std::mutex mutex_;
  std::array<Message, kKinds> last_;
  int64_t count_ = 0;
  std::optional<grpc::Status> status_;  // once the call has ended
  // Of its own, so that who is woken does not wait until all are.
  std::mutex clients_mutex_;
  std::set<const WakeUp*> clients_;
  std::thread reader_;
};

// What one client gets of a watch, which ends with its last client: first the present estimate,
// then each new one.
class WatchEvents final : public EventSource {
 public:
  explicit WatchEvents(std::shared_ptr<SharedWatch> watch);
  ~WatchEvents() override;

  WebCall::Event Await(int client, WebCall::Clock::time_point deadline) override;
  Text Take() override;
  grpc::Status status() const override;

 private:
  // Returns the oldest message that the client has not been given; null if there is none.
  const SharedWatch::Message* Next() const;

  const std::shared_ptr<SharedWatch> watch_;
  const WakeUp wake_up_;
  std::array<int64_t, SharedWatch::kKinds> taken_{};  // numbers
};

// The watches of a server. Thread-safe.
class SharedWatches {
 public:
  // Who asks, as far as it decides on what is seen, and for what; whatever the order.
  using Key = std::vector<std::string>;

  explicit SharedWatches(std::shared_ptr<grpc::Channel> channel) : channel_(std::move(channel)) {}

  // Returns what a client gets of the watch of this key, which `request` starts if there is none.
  std::shared_ptr<EventSource> Join(const Key& key, const WebCall::Request& request);
  // Returns whether there is a watch of this key.
  bool IsOpen(const Key& key) const;

 private:
  // Returns the watch of a key; null if there is none. Called with the mutex held.
  std::shared_ptr<SharedWatch> Find(const Key& key) const;

  const std::shared_ptr<grpc::Channel> channel_;
  mutable std::mutex mutex_;
  std::map<Key, std::weak_ptr<SharedWatch>> watches_;
};

}  // namespace polyest::internal
