#include "server/journal/postgres_node.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include "core/common/status.h"
#include "proto/wire/refusal/refusal.h"
#include "server/journal/postgres_nodes.h"
#include "server/journal/postgres_status.h"
#include "server/journal/session_row.h"

namespace polyest::internal {
namespace {

constexpr std::chrono::seconds kBeat{1};
// Pause between two pieces of what deleted sessions have left.
constexpr std::chrono::milliseconds kTidyPause{5};
// After so many beats, sessions of imports that did not come to their end are looked for.
constexpr int kBeatsBetweenSearches = 10;
constexpr int kAttempts = 3;

constexpr char kTake[] =
    "UPDATE owner SET node = $2, epoch = epoch + 1 WHERE session = $1 AND (node IS NULL OR node = "
    "$2 OR NOT EXISTS (SELECT 1 FROM node WHERE node.node = owner.node AND lease_until > "
    "clock_timestamp())) RETURNING epoch, (SELECT tenant FROM session WHERE number = $1)";
constexpr char kOwnerOf[] =
    "SELECT owner.node, address, lease_until > clock_timestamp() FROM owner LEFT JOIN node ON "
    "node.node = owner.node WHERE session = $1";
constexpr char kLastPlace[] =
    "SELECT " POLYEST_PLACE_COLUMNS " FROM batch WHERE session = $1 ORDER BY sequence DESC LIMIT 1";
constexpr char kRenew[] = "UPDATE node SET lease_until = clock_timestamp() + " POLYEST_LEASE
                          ", address = $2, streams = $3, busy_cores = $4 WHERE node = $1 AND "
                          "lease_until > clock_timestamp() RETURNING draining";
constexpr char kRenewLapsed[] =
    "INSERT INTO node (node, name, address, draining, lease_until) OVERRIDING SYSTEM VALUE VALUES "
    "($1, $2, $3, $4, clock_timestamp() + " POLYEST_LEASE
    ") ON CONFLICT (node) DO UPDATE SET lease_until = excluded.lease_until, address = "
    "excluded.address";
constexpr char kEndEarlierRun[] =
    "WITH gone AS (DELETE FROM node WHERE node <> $1 AND name = $2 RETURNING node) UPDATE owner "
    "SET "
    "node = NULL, epoch = epoch + 1 FROM gone WHERE owner.node = gone.node";
// Sessions that were never shown, of nodes that do not live.
constexpr char kDropHidden[] =
    "WITH gone AS (DELETE FROM session USING owner WHERE hidden AND owner.session = number AND NOT "
    "EXISTS (SELECT 1 FROM node WHERE node.node = owner.node AND lease_until > clock_timestamp()) "
    "RETURNING number), disowned AS (DELETE FROM owner USING gone WHERE session = number) INSERT "
    "INTO deleted SELECT number FROM gone";
constexpr char kRemoveBatches[] =
    "DELETE FROM batch WHERE ctid = ANY (ARRAY (SELECT batch.ctid FROM batch WHERE session = "
    "(SELECT session FROM deleted ORDER BY session LIMIT 1) LIMIT 256))";
constexpr char kRemoveParts[] =
    "DELETE FROM part WHERE ctid = ANY (ARRAY (SELECT part.ctid FROM part WHERE session = "
    "(SELECT session FROM deleted ORDER BY session LIMIT 1) LIMIT 256))";
constexpr char kRemoveRest[] =
    "WITH done AS (DELETE FROM deleted WHERE NOT EXISTS (SELECT 1 FROM batch WHERE batch.session = "
    "deleted.session) AND NOT EXISTS (SELECT 1 FROM part WHERE part.session = deleted.session) "
    "RETURNING session), history AS (DELETE FROM history USING done WHERE "
    "history.session = done.session) DELETE FROM snapshot USING done WHERE snapshot.session = "
    "done.session";

absl::Status OwnedBy(const std::string& address) {
  return Refuse(absl::StatusCode::kUnavailable,
                absl::StrFormat("the session is served by the daemon at %s; ask there, or here "
                                "again if that one is gone",
                                address.empty() ? "an address not known yet" : address),
                {.reason = kOwnedElsewhere, .retry_delay = kBeat, .owner = address});
}

}  // namespace

absl::StatusOr<std::unique_ptr<PostgresNode>> PostgresNode::Join(PostgresPool& pool,
                                                                 const PostgresTarget& target,
                                                                 std::string name) {
  std::unique_ptr<PostgresNode> node(new PostgresNode(pool, target, std::move(name)));
  POLYEST_ASSIGN_OR_RETURN(node->connection_, PostgresConnection::Open(target));
  POLYEST_RETURN_IF_ERROR(node->Register(*node->connection_));
  node->thread_ = std::jthread([self = node.get()](std::stop_token stop) { self->Run(stop); });
  return node;
}

PostgresNode::PostgresNode(PostgresPool& pool, const PostgresTarget& target, std::string name)
    : pool_(pool), target_(target), name_(std::move(name)) {}

PostgresNode::~PostgresNode() {
  if (thread_.joinable()) {
    thread_.request_stop();
    thread_.join();
  }
  if (number_ == 0) return;
  const PostgresParameters own = PostgresParameters().Add(number_);
  // Whoever cannot be told waits for the end of the lease.
  if (pool_.Query("UPDATE owner SET node = NULL WHERE node = $1", own).ok()) {
    pool_.Query("DELETE FROM node WHERE node = $1", own).status().IgnoreError();
  }
}

absl::Status PostgresNode::Register(PostgresConnection& connection) {
  // A lease that a crash of the database shortens harms nobody, so that no beat waits for the disk.
  POLYEST_RETURN_IF_ERROR(connection.Execute("SET synchronous_commit = off"));
  const Clock::time_point sent = Clock::now();
  POLYEST_ASSIGN_OR_RETURN(
      const PostgresResult result,
      connection.Query("INSERT INTO node (name, address, lease_until) VALUES ($1, '', "
                       "clock_timestamp() + " POLYEST_LEASE ") RETURNING node",
                       PostgresParameters().AddText(name_)));
  number_ = result.Integer(0, 0);
  lease_until_ = (sent + kLease).time_since_epoch().count();
  POLYEST_RETURN_IF_ERROR(connection.Query(kDropHidden).status());
  return connection
      .Query(
          "DELETE FROM node WHERE lease_until < clock_timestamp() - interval '1 day' AND NOT "
          "EXISTS (SELECT 1 FROM owner WHERE owner.node = node.node)")
      .status();
}

void PostgresNode::Announce(const std::string& address, std::function<int64_t()> streams) {
  const std::lock_guard lock(mutex_);
  address_ = address;
  streams_ = std::move(streams);
  waiting_.notify_all();
}

void PostgresNode::StartDraining() {
  {
    const std::lock_guard lock(mutex_);
    draining_ = true;
    waiting_.notify_all();
  }
  // Whoever cannot be told finds a node that passes calls on.
  pool_.Query("UPDATE node SET draining = true WHERE node = $1", PostgresParameters().Add(number_))
      .status()
      .IgnoreError();
}

bool PostgresNode::AwaitDraining(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  return waiting_.wait(lock, stop, [this] { return draining_.load(); });
}

absl::Status PostgresNode::CheckTakes() const {
  if (!draining_) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(const std::string taker, FindTaker(pool_, number_));
  if (taker.empty()) return absl::OkStatus();
  return Refuse(absl::StatusCode::kUnavailable,
                absl::StrFormat("this daemon hands its sessions over; ask the daemon at %s", taker),
                {.reason = kOwnedElsewhere, .retry_delay = kBeat, .owner = taker});
}

void PostgresNode::Run(std::stop_token stop) {
  std::string announced;
  bool tidying = true;
  for (int beats = 0; !stop.stop_requested();) {
    const auto pause = tidying ? kTidyPause : std::chrono::milliseconds(kBeat);
    {
      std::unique_lock lock(mutex_);
      waiting_.wait_for(lock, stop, pause,
                        [&] { return address_ != announced || (deleted_ && !tidying); });
      tidying = std::exchange(deleted_, false) || tidying;
    }
    if (stop.stop_requested()) return;
    const auto left = Clock::duration(lease_until_) - Clock::now().time_since_epoch();
    bool due = left < kLease - kBeat + std::chrono::milliseconds(100);
    {
      const std::lock_guard lock(mutex_);
      due = due || address_ != announced;
      announced = address_;
    }
    if (due && !Beat().ok()) {
      connection_ = nullptr;
      tidying = false;
      continue;
    }
    if (due && ++beats % kBeatsBetweenSearches == 0) {
      connection_->Query(kDropHidden).status().IgnoreError();
      tidying = true;
    }
    if (tidying) tidying = connection_ != nullptr && Tidy();
  }
}

absl::Status PostgresNode::Beat() {
  if (connection_ == nullptr) {
    POLYEST_ASSIGN_OR_RETURN(connection_, PostgresConnection::Open(target_));
    POLYEST_RETURN_IF_ERROR(connection_->Execute("SET synchronous_commit = off"));
  }
  std::string address;
  int64_t streams = 0;
  {
    const std::lock_guard lock(mutex_);
    address = address_;
    if (streams_) streams = streams_();
  }
  const double busy_cores = BusyCores();
  const Clock::time_point sent = Clock::now();
  POLYEST_ASSIGN_OR_RETURN(
      const PostgresResult renewed,
      connection_->Query(
          kRenew, PostgresParameters().Add(number_).AddText(address).Add(streams).Add(busy_cores)));
  if (renewed.rows() > 0 && renewed.Flag(0, 0)) {
    const std::lock_guard lock(mutex_);
    draining_ = true;
    waiting_.notify_all();
  }
  if (renewed.rows() == 0) POLYEST_RETURN_IF_ERROR(RenewLapsed(address));
  lease_until_ = (sent + kLease).time_since_epoch().count();
  const bool succeeds = !succeeded_ && !address.empty() && !name_.empty();
  return succeeds ? EndEarlierRun() : absl::OkStatus();
}

absl::Status PostgresNode::RenewLapsed(const std::string& address) {
  spdlog::warn("this node's lease was over: others may have taken its sessions");
  POLYEST_RETURN_IF_ERROR(
      connection_
          ->Query(
              kRenewLapsed,
              PostgresParameters().Add(number_).AddText(name_).AddText(address).AddFlag(draining_))
          .status());
  return Review(*connection_);
}

absl::Status PostgresNode::EndEarlierRun() {
  POLYEST_RETURN_IF_ERROR(
      connection_->Query(kEndEarlierRun, PostgresParameters().Add(number_).AddText(name_))
          .status());
  succeeded_ = true;
  return connection_->Query(kDropHidden).status();
}

double PostgresNode::BusyCores() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  const auto before = std::exchange(
      used_, std::chrono::seconds(used.tv_sec) + std::chrono::nanoseconds(used.tv_nsec));
  const Clock::time_point now = Clock::now();
  const std::chrono::duration<double> elapsed = now - std::exchange(measured_, now);
  return (used_ - before) / elapsed;
}

absl::Status PostgresNode::Review(PostgresConnection& connection) {
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult owned,
                           connection.Query("SELECT session, epoch FROM owner WHERE node = $1",
                                            PostgresParameters().Add(number_)));
  std::map<int64_t, int64_t> epochs;
  for (int row = 0; row < owned.rows(); ++row)
    epochs[owned.Integer(row, 0)] = owned.Integer(row, 1);
  const std::lock_guard lock(mutex_);
  // A session that was claimed meanwhile has a greater epoch.
  std::erase_if(holds_, [&](const auto& hold) {
    const auto epoch = epochs.find(hold.first);
    return epoch == epochs.end() || epoch->second > hold.second.epoch;
  });
  return absl::OkStatus();
}

bool PostgresNode::Tidy() {
  for (const char* const remove : {kRemoveBatches, kRemoveParts}) {
    const auto removed = connection_->Query(remove);
    if (!removed.ok()) return false;
    if (removed->changes() > 0) return true;
  }
  const auto rest = connection_->Query(kRemoveRest);
  if (!rest.ok()) return false;
  const auto left = connection_->Query("SELECT count(*) FROM deleted");
  return left.ok() && left->Integer(0, 0) > 0;
}

void PostgresNode::RemoveDeleted() {
  const std::lock_guard lock(mutex_);
  deleted_ = true;
  waiting_.notify_all();
}

absl::StatusOr<SessionPlace> PostgresNode::Claim(int64_t session) {
  if (Clock::now().time_since_epoch().count() >= lease_until_) {
    return DatabaseAway("this daemon's lease is over");
  }
  if (draining_) POLYEST_RETURN_IF_ERROR(CheckOwner(session));
  POLYEST_RETURN_IF_ERROR(Take(session));
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult last,
                           pool_.Query(kLastPlace, PostgresParameters().Add(session)));
  const SessionPlace place =
      last.rows() == 0 ? SessionPlace() : ReadSessionPlace(PostgresRow(last, 0), 0);
  // Removes the parts of a batch that was never completed. The claim keeps its sender from adding
  // more.
  pool_
      .Query("DELETE FROM part WHERE session = $1 AND sequence > $2",
             PostgresParameters().Add(session).Add(place.sequence))
      .status()
      .IgnoreError();
  return place;
}

absl::Status PostgresNode::Take(int64_t session) {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    POLYEST_ASSIGN_OR_RETURN(const PostgresResult taken,
                             pool_.Query(kTake, PostgresParameters().Add(session).Add(number_)));
    if (taken.rows() > 0) {
      const std::lock_guard lock(mutex_);
      Hold& hold = holds_[session];
      hold.epoch = std::max(hold.epoch, taken.Integer(0, 0));
      hold.tenant = taken.Bytes(0, 1);
      return absl::OkStatus();
    }
    POLYEST_RETURN_IF_ERROR(CheckOwner(session));
    // The owner's lease has ended, or it has let go, between the two statements.
  }
  return DatabaseAway("several daemons take the session at once");
}

absl::Status PostgresNode::CheckOwner(int64_t session) const {
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult owner,
                           pool_.Query(kOwnerOf, PostgresParameters().Add(session)));
  if (owner.rows() == 0) return NoSuchSession();
  if (owner.Flag(0, 2) && owner.Integer(0, 0) == number_) return absl::OkStatus();
  if (owner.Flag(0, 2)) return OwnedBy(owner.Bytes(0, 1));
  return CheckTakes();
}

void PostgresNode::Release(int64_t session) {
  Hold hold;
  {
    const std::lock_guard lock(mutex_);
    const auto found = holds_.find(session);
    if (found == holds_.end()) return;
    hold = std::move(found->second);
    holds_.erase(found);
  }
  pool_
      .Query("UPDATE owner SET node = NULL WHERE session = $1 AND node = $2 AND epoch = $3",
             PostgresParameters().Add(session).Add(number_).Add(hold.epoch))
      .status()
      .IgnoreError();
}

void PostgresNode::OnCreated(int64_t session, const std::string& tenant) {
  const std::lock_guard lock(mutex_);
  holds_[session] = {1, tenant};
}

void PostgresNode::OnDeleted(int64_t session) {
  const std::lock_guard lock(mutex_);
  holds_.erase(session);
}

PostgresNode::Hold PostgresNode::HoldOf(int64_t session) const {
  const std::lock_guard lock(mutex_);
  const auto found = holds_.find(session);
  return found == holds_.end() ? Hold() : found->second;
}

bool PostgresNode::Owns(int64_t session) const {
  if (Clock::now().time_since_epoch().count() >= lease_until_) return false;
  return HoldOf(session).epoch > 0;
}

}  // namespace polyest::internal
