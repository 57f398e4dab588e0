#pragma once

// Bounds the memory that the bodies of requests and answers take together while clients send and
// read them, as slowly as they like.

#include <cstdint>
#include <mutex>

namespace polyest::internal {

// Thread-safe.
class BodyMemory {
 public:
  explicit BodyMemory(int64_t bytes) : free_(bytes) {}

  // Holds memory for one request, and gives it back when it ends.
  class Share {
   public:
    explicit Share(BodyMemory& memory) : memory_(memory) {}
    ~Share() { memory_.Give(bytes_); }
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;

    // Takes more; false if there is not so much.
    bool Take(int64_t bytes) {
      if (!memory_.Take(bytes)) return false;
      bytes_ += bytes;
      return true;
    }

   private:
    BodyMemory& memory_;
    int64_t bytes_ = 0;
  };

 private:
  bool Take(int64_t bytes) {
    const std::lock_guard lock(mutex_);
    if (bytes > free_) return false;
    free_ -= bytes;
    return true;
  }
  void Give(int64_t bytes) {
    const std::lock_guard lock(mutex_);
    free_ += bytes;
  }

  std::mutex mutex_;
  int64_t free_;
};

}  // namespace polyest::internal
