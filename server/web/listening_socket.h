#pragma once

// A TCP port that is listened on.

#include <absl/status/statusor.h>

#include <memory>
#include <string>

namespace polyest::internal {

// Returns in words why an address cannot be listened on, given the error of the system call.
std::string WhyNotListening(int error);

class ListeningSocket {
 public:
  // Binds the port and listens. `host` is a name, an IPv4 address, or an IPv6 address in brackets;
  // port 0 picks a free one. UNAVAILABLE when that is not possible, naming the `option`.
  static absl::StatusOr<std::unique_ptr<ListeningSocket>> Open(const char* option,
                                                               const std::string& host, int port);
  ~ListeningSocket();
  ListeningSocket(const ListeningSocket&) = delete;
  ListeningSocket& operator=(const ListeningSocket&) = delete;

  int port() const { return port_; }
  // Returns the next connection; −1 after Stop. A connection that fails before it is taken, and
  // want of descriptors or memory, delay the next one only.
  int Accept() const;
  // Makes Accept return from here on. To be called from any thread.
  void Stop() const;
  // Returns a descriptor that is readable from Stop on.
  int stop_descriptor() const { return stop_; }

 private:
  ListeningSocket(int descriptor, int stop, int port)
      : descriptor_(descriptor), stop_(stop), port_(port) {}

  const int descriptor_;
  const int stop_;  // becomes readable when Stop is called
  const int port_;
};

}  // namespace polyest::internal
