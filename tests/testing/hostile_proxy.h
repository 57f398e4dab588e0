#pragma once

// A TCP proxy on a port of this machine that treats connections like a bad network: it cuts them
// within a message, delays them until a later connection has been made, and delivers the bytes of a
// client a second time, later, on a separate connection.

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
  // Starts the proxy in front of `server`, HOST:PORT. It forwards connections unharmed at first.
  HostileProxy(const std::string& server, uint64_t seed);
  ~HostileProxy();
  HostileProxy(const HostileProxy&) = delete;
  HostileProxy& operator=(const HostileProxy&) = delete;

  // Returns the address of the proxy, HOST:PORT.
  const std::string& address() const { return address_; }
  // Sets whether further connections are harmed.
  void SetHostile(bool hostile) { hostile_ = hostile; }

  // Numbers of connections that were harmed.
  struct Harm {
    int cut = 0, held = 0, repeated = 0;
  };
  Harm harm() const;

 private:
  // The harm planned for a connection.
  struct Plan {
    int64_t cut_after = -1;  // number of bytes from the client; negative: not cut
    bool hold = false;       // delay it until another connection is made
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
