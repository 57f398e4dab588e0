#pragma once

// A TCP proxy on a port of this machine that treats connections as a bad network does: it cuts
// them in the midst of a message, holds them back until a later one has passed them, and delivers
// what a client has sent once more, later, on a connection of its own.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace polyest::internal {

class HostileProxy {
 public:
  // In front of HOST:PORT. Peaceful at first.
  HostileProxy(const std::string& server, uint64_t seed);
  ~HostileProxy();
  HostileProxy(const HostileProxy&) = delete;
  HostileProxy& operator=(const HostileProxy&) = delete;

  const std::string& address() const { return address_; }
  // Whether connections from here on are harmed.
  void SetHostile(bool hostile) { hostile_ = hostile; }

  struct Harm {
    int cut = 0, held = 0, repeated = 0;
  };
  Harm harm() const;

 private:
  // What will be done to a connection.
  struct Plan {
    int64_t cut_after = -1;  // bytes from the client; negative: not cut
    bool hold = false;       // until another connection has come
    bool repeat = false;
  };

  void Accept();
  void Serve(int client, Plan plan, int64_t number);
  void Repeat(const std::string& bytes);
  int Connect() const;
  Plan Draw();
  bool WaitForLater(int64_t number);

  int server_port_;
  int listener_;
  std::string address_;
  std::mt19937_64 random_;
  std::atomic<bool> hostile_ = false;

  mutable std::mutex mutex_;
  std::condition_variable accepted_;
  int64_t connections_ = 0;
  bool ending_ = false;
  std::vector<int> sockets_;
  Harm harm_;
  std::vector<std::jthread> connections_threads_;
  std::jthread thread_;
};

}  // namespace polyest::internal
