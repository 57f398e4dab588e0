#pragma once

// Weighs what streams hold: the batches of clients that are not computed yet, and the records that
// clients leave unread. Each stream is bounded by itself; this bounds those of a tenant and of the
// daemon together.

#include <absl/status/status.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace polyest::internal {

// Thread-safe. Must outlive its shares.
class StreamMemory {
 public:
  struct Limits {
    int64_t tenant = int64_t{256} << 20;  // bytes of the streams of a tenant
    int64_t all = int64_t{1} << 30;       // bytes of all streams
  };

  // Is what one stream holds, as long as it exists. For use by one thread at a time.
  class Share {
   public:
    // Of a stream of the tenant, which holds nothing yet.
    Share(StreamMemory& memory, const std::string& tenant)
        : memory_(memory), tenant_(memory.OfTenant(tenant)) {}
    ~Share() { Add(-bytes_); }
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;

    // Adds to what the stream holds, or subtracts from it.
    void Add(int64_t bytes) {
      bytes_ += bytes;
      *tenant_ += bytes;
      memory_.all_ += bytes;
    }
    int64_t bytes() const { return bytes_; }
    // Returns whether the streams of the tenant, and all streams, hold less than they may. A stream
    // may pass the limit by one message.
    bool HasRoom() const {
      return *tenant_ < memory_.limits_.tenant && memory_.all_ < memory_.limits_.all;
    }
    // Returns OK if there is room, otherwise RESOURCE_EXHAUSTED with the time to try again.
    absl::Status CheckRoom() const;

   private:
    StreamMemory& memory_;
    const std::shared_ptr<std::atomic<int64_t>> tenant_;
    int64_t bytes_ = 0;
  };

  StreamMemory() : StreamMemory(Limits()) {}
  explicit StreamMemory(const Limits& limits) : limits_(limits) {}

 private:
  // Returns what the streams of a tenant hold.
  std::shared_ptr<std::atomic<int64_t>> OfTenant(const std::string& tenant);

  const Limits limits_;
  std::atomic<int64_t> all_ = 0;
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<std::atomic<int64_t>>> tenants_;  // those with streams
};

}  // namespace polyest::internal
