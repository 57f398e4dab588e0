#include "server/service/operation_store.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "core/common/status.h"
#include "proto/wire/refusal/refusal.h"
#include "server/execution/guarded.h"
#include "server/service/call_stop.h"
#include "server/service/status_mapping.h"
#include "server/telemetry/request_id.h"

namespace polyest::internal {
namespace {

// Time after which an operation may have ended.
constexpr std::chrono::seconds kRetryLater{1};

}  // namespace

// Takes up one of the tenant's places. The work holds it in the queue and until it has ended,
// because its request takes memory as long, whether its operation has been forgotten or not. The
// store waits for the object itself, which the work holds until nothing is left of it.
class OperationStore::Place {
 public:
  // Called with the store's mutex held; the destructor without.
  Place(OperationStore& store, std::string tenant) : store_(store), tenant_(std::move(tenant)) {
    ++store_.places_[tenant_];
    ++store_.holders_;
  }
  ~Place() {
    const std::lock_guard lock(store_.mutex_);
    Leave();
    --store_.holders_;
    store_.left_.notify_all();
  }
  const std::string& tenant() const { return tenant_; }
  // Gives the place back, unless that has been done. Called with the store's mutex held.
  void Leave() {
    if (std::exchange(left_, true)) return;
    const auto place = store_.places_.find(tenant_);
    if (--place->second == 0) store_.places_.erase(place);
  }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;

 private:
  OperationStore& store_;
  const std::string tenant_;
  bool left_ = false;
};

// Holds one operation. The work shares its ownership, so that an operation may be forgotten while
// it is under way.
class OperationStore::Entry {
 public:
  Entry(std::string name, std::string method, google::protobuf::Timestamp created,
        Clock::time_point now)
      : begin_(now) {
    operation_.set_name(std::move(name));
    operation_.set_method(std::move(method));
    operation_.set_state(v1::Operation::QUEUED);
    *operation_.mutable_create_time() = std::move(created);
  }

  const std::string& name() const { return operation_.name(); }
  // Returns the result, which only the job may use before its end.
  v1::ComputationResult* result() { return &result_; }
  std::stop_token token() const { return stop_.get_token(); }
  std::stop_source& stop_source() { return stop_; }

  // Begins the work; returns false if it was cancelled while it waited.
  bool Begin() {
    const std::lock_guard lock(mutex_);
    if (end_) return false;
    operation_.set_state(v1::Operation::RUNNING);
    return true;
  }

  // Ends the operation if it has not ended already.
  void End(const absl::Status& status, const google::protobuf::Timestamp& time,
           Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    EndNow(status, time, now);
  }

  // Asks the work to end early; ends the operation at once if its work has not begun.
  void Cancel(const google::protobuf::Timestamp& time, Clock::time_point now) {
    stop_.request_stop();
    const std::lock_guard lock(mutex_);
    if (operation_.state() != v1::Operation::QUEUED) return;
    EndNow(Stop(token()).Check(), time, now);
  }

  // Returns the operation without its response or error.
  v1::Operation Describe(Clock::time_point now) const {
    v1::Operation operation = DescribeWithError(now);
    operation.clear_result();
    return operation;
  }
  // Returns the operation with its response or error. Others need not wait while a large response
  // is copied: it does not change any more.
  v1::Operation DescribeWithResult(Clock::time_point now) const {
    v1::Operation operation = DescribeWithError(now);
    if (operation.state() == v1::Operation::SUCCEEDED) *operation.mutable_response() = result_;
    return operation;
  }

  // Returns the memory of the result; 0 while there is none to be fetched.
  int64_t result_bytes() const {
    const std::lock_guard lock(mutex_);
    return result_bytes_;
  }

  // Returns the time of the end; nothing while the operation is under way.
  std::optional<Clock::time_point> end() const {
    const std::lock_guard lock(mutex_);
    return end_;
  }

 private:
  v1::Operation DescribeWithError(Clock::time_point now) const {
    const std::lock_guard lock(mutex_);
    v1::Operation operation = operation_;
    const std::chrono::duration<double> elapsed = end_.value_or(now) - begin_;
    operation.set_elapsed_time_s(elapsed.count());
    return operation;
  }
  // Called with the mutex held.
  void EndNow(const absl::Status& status, const google::protobuf::Timestamp& time,
              Clock::time_point now) {
    if (end_) return;
    end_ = now;
    *operation_.mutable_end_time() = time;
    if (status.ok()) {
      operation_.set_state(v1::Operation::SUCCEEDED);
      result_bytes_ = static_cast<int64_t>(result_.SpaceUsedLong());
      return;
    }
    const bool cancelled = absl::IsCancelled(status) && stop_.stop_requested();
    operation_.set_state(cancelled ? v1::Operation::CANCELLED : v1::Operation::FAILED);
    *operation_.mutable_error() = ToRpcStatus(status);
    result_.Clear();
  }

  const Clock::time_point begin_;
  std::stop_source stop_;
  v1::ComputationResult result_;

  mutable std::mutex mutex_;
  v1::Operation operation_;
  int64_t result_bytes_ = 0;
  std::optional<Clock::time_point> end_;
};

OperationStore::OperationStore(const OperationLimits& limits, WallClock wall_clock, Now now)
    : limits_(limits), wall_clock_(std::move(wall_clock)), now_(std::move(now)) {}

OperationStore::~OperationStore() {
  CancelAll();
  std::unique_lock lock(mutex_);
  left_.wait(lock, [this] { return holders_ == 0; });
}

void OperationStore::CancelAll() {
  const std::lock_guard lock(mutex_);
  for (const auto& [key, entry] : entries_) Cancel(*entry);
}

void OperationStore::Cancel(Entry& entry) { entry.Cancel(wall_clock_(), now_()); }

void OperationStore::ForgetOld() {
  const Clock::time_point oldest = now_() - limits_.kept_for;
  std::erase_if(entries_, [&](const auto& one) {
    const auto end = one.second->end();
    return end && *end < oldest;
  });
}

std::pair<OperationStore::Entries::iterator, OperationStore::Entries::iterator>
OperationStore::OfTenant(const std::string& tenant) {
  return {entries_.lower_bound({tenant, 0}),
          entries_.upper_bound({tenant, std::numeric_limits<int64_t>::max()})};
}

absl::Status OperationStore::MakePlace(const std::string& tenant) {
  const auto [first, last] = OfTenant(tenant);
  const auto places = places_.find(tenant);
  const bool full = places != places_.end() && places->second >= limits_.per_tenant;
  const auto operations = static_cast<size_t>(std::distance(first, last));
  if (!full && operations < limits_.per_tenant) return absl::OkStatus();
  auto oldest = last;
  for (auto one = first; one != last; ++one) {
    const auto end = one->second->end();
    if (end && (oldest == last || *end < *oldest->second->end())) oldest = one;
  }
  if (full || oldest == last) {
    return Refuse(
        absl::StatusCode::kResourceExhausted,
        absl::StrCat("a tenant has at most ", limits_.per_tenant, " operations under way"),
        {.reason = kBusy, .retry_delay = kRetryLater});
  }
  entries_.erase(oldest);
  return absl::OkStatus();
}

void OperationStore::BoundResults(const std::string& tenant) {
  const auto [first, last] = OfTenant(tenant);
  std::vector<Entries::iterator> kept;
  int64_t bytes = 0;
  for (auto one = first; one != last; ++one) {
    if (one->second->result_bytes() == 0) continue;
    kept.push_back(one);
    bytes += one->second->result_bytes();
  }
  std::ranges::stable_sort(kept, {}, [](const auto& one) { return *one->second->end(); });
  for (size_t i = 0; i + 1 < kept.size() && bytes > limits_.result_bytes_per_tenant; ++i) {
    bytes -= kept[i]->second->result_bytes();
    entries_.erase(kept[i]);
  }
}

absl::StatusOr<v1::Operation> OperationStore::Start(const std::string& tenant,
                                                    const std::string& method,
                                                    const MakeJob& make_job) {
  const auto entry = std::make_shared<Entry>(
      absl::StrCat("operations/", limits_.prefix, MakeRequestId()), method, wall_clock_(), now_());
  POLYEST_ASSIGN_OR_RETURN(const Job job, make_job(entry->result()));
  Key key;
  std::shared_ptr<Place> place;
  {
    const std::lock_guard lock(mutex_);
    ForgetOld();
    POLYEST_RETURN_IF_ERROR(MakePlace(tenant));
    place = std::make_shared<Place>(*this, tenant);
    key = {tenant, ++started_};
    entries_[key] = entry;
  }
  const v1::Operation started = entry->Describe(now_());
  const absl::Status accepted =
      job.submit([this, entry, place, work = job.work] { Run(entry, place, work); });
  if (accepted.ok()) return started;
  const std::lock_guard lock(mutex_);
  entries_.erase(key);
  return accepted;
}

void OperationStore::Run(const std::shared_ptr<Entry>& entry, const std::shared_ptr<Place>& place,
                         const UnaryCall::Work& work) {
  if (!entry->Begin()) return;
  const CallStop call_stop(entry->token(), limits_.max_computing);
  const Stop stop = call_stop.Begin();
  const auto finish = [this, entry, place, call_stop](const absl::Status& outcome) {
    // Whoever sees the end may start another operation at once, and sees no result too many.
    const std::lock_guard lock(mutex_);
    entry->End(call_stop.Name(outcome), wall_clock_(), now_());
    place->Leave();
    BoundResults(place->tenant());
  };
  const absl::Status status = Guarded([&] { return work(stop, entry->stop_source(), finish); });
  if (!status.ok()) finish(status);
}

absl::StatusOr<OperationStore::Entries::iterator> OperationStore::Find(const std::string& tenant,
                                                                       const std::string& name) {
  ForgetOld();
  const auto [first, last] = OfTenant(tenant);
  for (auto one = first; one != last; ++one) {
    if (one->second->name() == name) return one;
  }
  return absl::NotFoundError(absl::StrCat(name, " does not exist or has been forgotten"));
}

absl::StatusOr<v1::Operation> OperationStore::Get(const std::string& tenant,
                                                  const std::string& name) {
  std::shared_ptr<const Entry> entry;
  {
    const std::lock_guard lock(mutex_);
    POLYEST_ASSIGN_OR_RETURN(const auto found, Find(tenant, name));
    entry = found->second;
  }
  return entry->DescribeWithResult(now_());
}

OperationStore::Page OperationStore::List(const std::string& tenant, int64_t after, size_t count) {
  const std::lock_guard lock(mutex_);
  ForgetOld();
  const auto last = OfTenant(tenant).second;
  Page page;
  for (auto one = entries_.upper_bound({tenant, after}); one != last; ++one) {
    page.more = page.operations.size() == count;
    if (page.more) break;
    page.operations.push_back(one->second->Describe(now_()));
    page.last = one->first.second;
  }
  return page;
}

absl::StatusOr<v1::Operation> OperationStore::Cancel(const std::string& tenant,
                                                     const std::string& name) {
  const std::lock_guard lock(mutex_);
  POLYEST_ASSIGN_OR_RETURN(const auto found, Find(tenant, name));
  Cancel(*found->second);
  return found->second->Describe(now_());
}

absl::Status OperationStore::Delete(const std::string& tenant, const std::string& name) {
  const std::lock_guard lock(mutex_);
  POLYEST_ASSIGN_OR_RETURN(const auto found, Find(tenant, name));
  Cancel(*found->second);
  entries_.erase(found);
  return absl::OkStatus();
}

}  // namespace polyest::internal
