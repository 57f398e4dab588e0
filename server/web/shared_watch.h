#pragma once

// Watches a session once for all HTTP clients that ask alike: with the same request, the same token
// and the same certificate. A call for each of them would cost many times what the estimates do.

#include <grpcpp/channel.h>

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

// The last estimate and the last prediction, as events, in the order in which they came.
class LatestEvents {
 public:
  enum class Kind { kEstimate, kPrediction };

  bool empty() const { return events_.empty(); }
  // Puts an event in place of the one of its kind.
  void Put(Kind kind, EventSource::Text event);
  // Forgets the event of a kind.
  void Remove(Kind kind);
  // Takes the older event out. There must be one.
  EventSource::Text Take();

 private:
  std::vector<std::pair<Kind, EventSource::Text>> events_;
};

class WatchEvents;

// One watch.
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
  // Gives a client what the last events were, and from here on each new one and the end.
  void Add(WatchEvents& client);
  void Remove(WatchEvents& client);

 private:
  // Takes the call's messages until it ends. Runs on the watch's own thread.
  void Read();
  // The same; returns how the call has ended.
  grpc::Status ReadAll();
  void Publish(LatestEvents::Kind kind, const EventSource::Text& event);

  WebCall call_;
  mutable std::mutex mutex_;
  LatestEvents latest_;                 // for clients who come later
  std::optional<grpc::Status> status_;  // once the call has ended
  std::set<WatchEvents*> clients_;
  std::thread reader_;
};

// Gives one client the events of a watch, which ends with its last client. As in a watch of one's
// own, a slow client misses estimates but never the last one. A client that comes later begins with
// the last estimate that was made, which need not be of the last batch.
class WatchEvents final : public EventSource {
 public:
  explicit WatchEvents(std::shared_ptr<SharedWatch> watch);
  ~WatchEvents() override;

  WebCall::Event Await(int client, WebCall::Clock::time_point deadline) override;
  Text Take() override;
  grpc::Status status() const override;

  // Keeps a call that is made for the client as long as the client stays, whatever it answers.
  void Keep(std::unique_ptr<WebCall> call) { call_ = std::move(call); }

  // These are for the watch.
  void Give(const LatestEvents& events);
  void Give(LatestEvents::Kind kind, const Text& event);
  void End(const grpc::Status& status);

 private:
  const std::shared_ptr<SharedWatch> watch_;
  std::unique_ptr<WebCall> call_;
  const WakeUp wake_up_;
  mutable std::mutex mutex_;
  LatestEvents events_;                 // that have not been taken
  std::optional<grpc::Status> status_;  // once the watch has ended
};

// The watches of a server. Thread-safe.
class SharedWatches {
 public:
  // Holds the request, and all of its client that decides on what this may see, in any fixed order.
  using Key = std::vector<std::string>;

  explicit SharedWatches(std::shared_ptr<grpc::Channel> channel) : channel_(std::move(channel)) {}

  // Returns what a client gets of the watch of this key, which `request` starts if there is none.
  std::shared_ptr<WatchEvents> Join(const Key& key, const WebCall::Request& request);
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
