#pragma once

// Lets long work be done one piece at a time, in turns between those who ask for it: whoever asks
// for much holds one place among those who wait.

#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace polyest::internal {

// Thread-safe.
class Turns {
 public:
  // Is a turn as long as it exists.
  class Turn {
   public:
    Turn() = default;

   private:
    friend class Turns;
    // Unlocked in the reverse order.
    std::shared_ptr<std::mutex> own_mutex_;
    std::unique_lock<std::mutex> own_;
    std::unique_lock<std::mutex> all_;
  };

  // Waits for a turn of `who`.
  Turn Take(const std::string& who) {
    Turn turn;
    turn.own_mutex_ = MutexOf(who);
    turn.own_ = std::unique_lock(*turn.own_mutex_);
    turn.all_ = std::unique_lock(all_);
    return turn;
  }

 private:
  std::shared_ptr<std::mutex> MutexOf(const std::string& who) {
    const std::lock_guard lock(mutex_);
    std::erase_if(waiting_, [](const auto& entry) { return entry.second.expired(); });
    std::weak_ptr<std::mutex>& known = waiting_[who];
    std::shared_ptr<std::mutex> mutex = known.lock();
    if (mutex == nullptr) known = mutex = std::make_shared<std::mutex>();
    return mutex;
  }

  std::mutex all_;
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<std::mutex>> waiting_;
};

}  // namespace polyest::internal
