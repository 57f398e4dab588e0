#pragma once

// Runs computations that no call waits for: they are started, asked for, and fetched when they are
// done.

#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "polyest/v1/operation_service.pb.h"
#include "server/service/calls.h"

namespace polyest::internal {

struct OperationLimits {
  size_t per_tenant = 64;                // largest number of operations, done or under way
  std::chrono::seconds kept_for{3'600};  // time that they are kept after their end
  std::chrono::seconds max_computing;    // longest computing time of one
  // Largest memory of a tenant's results. The oldest results are forgotten beyond it, with their
  // operations; the latest one stays.
  int64_t result_bytes_per_tenant = int64_t{256} << 20;
  std::string prefix{};  // of their names, behind "operations/"
};

// Keeps the operations of all tenants in memory, while they run and for an hour after their end.
// Thread-safe. An operation of another tenant is NOT_FOUND.
class OperationStore {
 public:
  using Clock = std::chrono::steady_clock;
  using WallClock = std::function<google::protobuf::Timestamp()>;
  using Now = std::function<Clock::time_point()>;
  // Makes the job that writes its answer into the result given.
  using MakeJob = std::function<absl::StatusOr<Job>(v1::ComputationResult*)>;

  OperationStore(const OperationLimits& limits, WallClock wall_clock, Now now = Clock::now);
  // Cancels the operations under way and waits until no work waits or runs.
  ~OperationStore();
  OperationStore(const OperationStore&) = delete;
  OperationStore& operator=(const OperationStore&) = delete;

  // Starts the job and returns its operation. Returns make_job's error if that fails;
  // RESOURCE_EXHAUSTED when all of the tenant's operations are under way, counting those cancelled
  // or deleted whose work has yet to leave its queue, or when the job finds no room in its queue.
  absl::StatusOr<v1::Operation> Start(const std::string& tenant, const std::string& method,
                                      const MakeJob& make_job);
  // Returns an operation, with its result if it has ended.
  absl::StatusOr<v1::Operation> Get(const std::string& tenant, const std::string& name);
  struct Page {
    std::vector<v1::Operation>
        operations;     // without results, in the order in which they were started
    int64_t last = 0;   // number of the last one
    bool more = false;  // whether others follow
  };
  // Returns at most `count` ≥ 1 operations, those whose number is above `after`. Numbers are ≥ 1.
  Page List(const std::string& tenant, int64_t after, size_t count);
  // Asks an operation to end early, and returns it; one that waits is cancelled at once, and one
  // that has ended stays as it is.
  absl::StatusOr<v1::Operation> Cancel(const std::string& tenant, const std::string& name);
  // Forgets an operation, and cancels it if it is under way.
  absl::Status Delete(const std::string& tenant, const std::string& name);
  // Cancels all operations under way.
  void CancelAll();

 private:
  class Entry;
  class Place;
  using Key = std::pair<std::string, int64_t>;  // tenant, number
  using Entries = std::map<Key, std::shared_ptr<Entry>>;

  // The following are called with the mutex held.
  void ForgetOld();
  absl::Status MakePlace(const std::string& tenant);
  // Forgets the oldest results of the tenant beyond their limit.
  void BoundResults(const std::string& tenant);
  std::pair<Entries::iterator, Entries::iterator> OfTenant(const std::string& tenant);
  absl::StatusOr<Entries::iterator> Find(const std::string& tenant, const std::string& name);
  void Cancel(Entry& entry);

  void Run(const std::shared_ptr<Entry>& entry, const std::shared_ptr<Place>& place,
           const UnaryCall::Work& work);

  const OperationLimits limits_;
  const WallClock wall_clock_;
  const Now now_;
  std::mutex mutex_;
  std::condition_variable left_;
  Entries entries_;
  std::map<std::string, size_t> places_;  // taken up by work, by tenant; none is 0
  size_t holders_ = 0;                    // number of Place objects
  int64_t started_ = 0;
};

}  // namespace polyest::internal
