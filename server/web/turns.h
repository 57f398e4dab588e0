#pragma once

// Lets long work be done one piece at a time, in turns between those who ask for it: whoever asks
// for much holds one place among those who wait.

#include <condition_variable>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>

namespace polyest::internal {

// Thread-safe. Must outlive its turns.
class Turns {
 public:
  // Is a turn as long as it exists.
  class Turn {
   public:
    Turn(Turns& turns, std::string who) : turns_(turns), who_(std::move(who)) {}
    ~Turn() {
      if (taken_) turns_.End(who_);
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    friend class Turns;

    Turns& turns_;
    const std::string who_;
    bool taken_ = false;
  };

  // Waits for a turn of `who`; null once Stop has been called, also if that is meanwhile.
  std::unique_ptr<Turn> Take(const std::string& who) {
    auto turn = std::make_unique<Turn>(*this, who);
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return stopped_ || !places_.contains(who); });
    if (stopped_) return nullptr;
    places_.insert(who);
    changed_.wait(lock, [&] { return stopped_ || !taken_; });
    if (stopped_) {
      places_.erase(who);
      return nullptr;
    }
    turn->taken_ = taken_ = true;
    return turn;
  }

  // Ends the wait of all who wait. A turn that is taken goes on.
  void Stop() {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    changed_.notify_all();
  }

 private:
  void End(const std::string& who) {
    const std::lock_guard lock(mutex_);
    taken_ = false;
    places_.erase(who);
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  bool taken_ = false;
  std::set<std::string> places_;  // of those who have a turn or wait for the next, one place each
};

}  // namespace polyest::internal
