#pragma once

// The connection of an HTTP client: bytes to and fro within time limits, plain or under TLS.

#include <openssl/types.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace polyest::internal {

// Is used by one thread, but for Shutdown.
class ClientSocket {
 public:
  using Clock = std::chrono::steady_clock;

  // Takes over a connected socket. `tls` is null for plain text.
  ClientSocket(int descriptor, std::shared_ptr<SSL_CTX> tls);
  ~ClientSocket();
  ClientSocket(const ClientSocket&) = delete;
  ClientSocket& operator=(const ClientSocket&) = delete;

  // Agrees on the encryption, if there is any. False when that fails, or not before the deadline.
  bool Begin(Clock::time_point deadline);
  // Waits until there is something to read; false if there is nothing before the deadline, or once
  // the descriptor `stop` is readable.
  bool AwaitReadable(int stop, Clock::time_point deadline) const;
  // Reads some bytes. 0 at the end, after a failure, and when nothing comes before the deadline.
  size_t Read(char* bytes, size_t size, Clock::time_point deadline);
  // Writes all bytes; false after a failure, or when the client does not take them by the deadline.
  bool Write(std::string_view bytes, Clock::time_point deadline);
  // Says that nothing more will be written.
  void FinishWriting(Clock::time_point deadline);

  // Makes all reads and writes fail, also those under way. To be called from any thread.
  void Shutdown() const;

  int descriptor() const { return descriptor_; }
  // Returns the client's address as gRPC writes it: "ipv4:192.0.2.7:50123".
  std::string Peer() const;
  // Returns the client's address without its port.
  std::string PeerHost() const;
  // Returns the daemon's address that the client has reached, without its port; IPv6 in brackets.
  std::string LocalHost() const;
  // Returns the common name of the client's certificate, escaped; empty without one.
  std::string CertificateName() const;

 private:
  struct SslDeleter {
    void operator()(SSL* ssl) const;
  };

  // Waits until the socket is ready for what TLS has asked for. False at the deadline, and when TLS
  // has failed.
  bool AwaitTls(int result, Clock::time_point deadline) const;

  const int descriptor_;
  const std::shared_ptr<SSL_CTX> tls_;
  std::unique_ptr<SSL, SslDeleter> ssl_;
};

}  // namespace polyest::internal
