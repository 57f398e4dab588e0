#pragma once

// Makes this process a node of those that share a database, and keeps which sessions it owns.
//
// Each session has one owner, which alone adds to it. A node lives as long as its lease, which it
// renews every second by the database's clock; the sessions of a node whose lease is over may be
// taken. Each taking makes the session's epoch one greater, and every write of a session carries
// the epoch and locks the owner's row for as long as its transaction lasts: whoever has lost a
// session, because it was stopped or cut off, can write nothing to it any more, whatever clocks
// say.

#include <absl/status/statusor.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "server/journal/postgres_pool.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

// Thread-safe.
class PostgresNode {
 public:
  // Goes with every write of a session.
  struct Hold {
    int64_t epoch = 0;
    std::string tenant;
  };

  // Joins the nodes of a database whose schema is prepared. A node of the same `name`, if that is
  // not empty, is taken for an earlier run of this one once this one is announced: it loses its
  // sessions. Only then is it certain that no other daemon listens at the address. The pool must
  // outlive this.
  static absl::StatusOr<std::unique_ptr<PostgresNode>> Join(PostgresPool& pool,
                                                            const PostgresTarget& target,
                                                            std::string name);
  // Lets go of all sessions and leaves.
  ~PostgresNode();
  PostgresNode(const PostgresNode&) = delete;
  PostgresNode& operator=(const PostgresNode&) = delete;

  int64_t number() const { return number_; }
  // Makes known at which address clients reach this node. `streams` returns the number of its open
  // streams, to be shown.
  void Announce(const std::string& address, std::function<int64_t()> streams);

  // As SharedJournal does.
  void StartDraining();
  bool AwaitDraining(const std::stop_token& stop);
  // Returns UNAVAILABLE, naming another node that could take sessions, when this one is to take
  // none.
  absl::Status CheckTakes() const;

  // Takes the session and returns its place. UNAVAILABLE, naming the owner, when it belongs to
  // another node that lives, and while this node's own lease is over; NOT_FOUND when there is no
  // such session. No write that was under way, of this node or another, is kept afterwards unless
  // the place tells of it.
  absl::StatusOr<SessionPlace> Claim(int64_t session);
  // Returns UNAVAILABLE, naming the owner, when another node that lives owns the session, or, while
  // this node hands its sessions over, shall own it.
  absl::Status CheckOwner(int64_t session) const;
  // Lets others take the session.
  void Release(int64_t session);

  // Notes that a session has been created, or deleted, by a write of this node.
  void OnCreated(int64_t session, const std::string& tenant);
  void OnDeleted(int64_t session);
  // Returns the hold on a session; one of epoch 0, which no session has, when there is none.
  Hold HoldOf(int64_t session) const;
  // Returns whether this node owns the session, as far as it knows, and its lease is not over.
  bool Owns(int64_t session) const;

  // Removes the batches of deleted sessions soon.
  void RemoveDeleted();

 private:
  using Clock = std::chrono::steady_clock;

  PostgresNode(PostgresPool& pool, const PostgresTarget& target, std::string name);
  absl::Status Take(int64_t session);
  absl::Status Register(PostgresConnection& connection);
  void Run(std::stop_token stop);
  // Renews the lease.
  absl::Status Beat();
  // Takes the lease anew after it was over, and looks which sessions others have taken meanwhile.
  absl::Status RenewLapsed(const std::string& address);
  // Ends this node's earlier run, which loses its sessions; those never shown are dropped.
  absl::Status EndEarlierRun();
  // Returns the processor time that this process has used a second since the last call.
  double BusyCores();
  // Forgets the sessions that other nodes have taken while the lease was over.
  absl::Status Review(PostgresConnection& connection);
  // Removes what deleted sessions have left, a piece at a time. Returns whether there may be more.
  bool Tidy();

  PostgresPool& pool_;
  const PostgresTarget target_;
  const std::string name_;
  int64_t number_ = 0;
  std::unique_ptr<PostgresConnection> connection_;  // of the thread; null while there is none
  std::chrono::duration<double> used_{0};  // processor time at the last beat; used by the thread
  Clock::time_point measured_;             // time of that beat
  bool succeeded_ = false;  // whether an earlier run has lost its sessions; used by the thread
  std::atomic<Clock::time_point::rep> lease_until_ = 0;  // by the clock of this process

  mutable std::mutex mutex_;
  std::condition_variable_any waiting_;
  std::string address_;
  std::function<int64_t()> streams_;
  std::atomic<bool> draining_ = false;  // set with the mutex held
  std::map<int64_t, Hold> holds_;       // by session
  bool deleted_ = true;                 // whether deleted sessions may have left something
  std::jthread thread_;
};

}  // namespace polyest::internal
