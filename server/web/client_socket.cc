#include "server/web/client_socket.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>

#include "server/net/socket_address.h"

namespace polyest::internal {
namespace {

using Clock = ClientSocket::Clock;

// Waits for an event of the socket, or for its end; false at the deadline, or once `stop`, if there
// is one, is readable.
bool Await(int descriptor, int16_t events, Clock::time_point deadline, int stop = -1) {
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    pollfd waiting[] = {{descriptor, events, 0}, {stop, POLLIN, 0}};
    const int happened = poll(waiting, 2, static_cast<int>(std::min<int64_t>(left, 60'000)));
    if (happened > 0) return waiting[1].revents == 0;
    if (happened < 0 && errno != EINTR) return false;
  }
}

IpAddress PeerOf(int descriptor) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (getpeername(descriptor, reinterpret_cast<sockaddr*>(&address), &size) != 0) return {};
  return ToIpAddress(address);
}

}  // namespace

void ClientSocket::SslDeleter::operator()(SSL* ssl) const { SSL_free(ssl); }

ClientSocket::ClientSocket(int descriptor, std::shared_ptr<SSL_CTX> tls)
    : descriptor_(descriptor), tls_(std::move(tls)) {}

ClientSocket::~ClientSocket() { close(descriptor_); }

bool ClientSocket::Begin(Clock::time_point deadline) {
  if (tls_ == nullptr) return true;
  ssl_.reset(SSL_new(tls_.get()));
  if (ssl_ == nullptr || SSL_set_fd(ssl_.get(), descriptor_) != 1) return false;
  while (true) {
    ERR_clear_error();
    const int result = SSL_accept(ssl_.get());
    if (result == 1) return true;
    if (!AwaitTls(result, deadline)) return false;
  }
}

bool ClientSocket::AwaitTls(int result, Clock::time_point deadline) const {
  switch (SSL_get_error(ssl_.get(), result)) {
    case SSL_ERROR_WANT_READ:
      return Await(descriptor_, POLLIN, deadline);
    case SSL_ERROR_WANT_WRITE:
      return Await(descriptor_, POLLOUT, deadline);
    default:
      ERR_clear_error();
      return false;
  }
}

bool ClientSocket::AwaitReadable(int stop, Clock::time_point deadline) const {
  const bool pending = ssl_ != nullptr && SSL_pending(ssl_.get()) > 0;
  return Await(descriptor_, pending ? POLLOUT : POLLIN, deadline, stop);
}

size_t ClientSocket::Read(char* bytes, size_t size, Clock::time_point deadline) {
  while (true) {
    if (ssl_ != nullptr) {
      ERR_clear_error();
      size_t count = 0;
      const int result = SSL_read_ex(ssl_.get(), bytes, size, &count);
      if (result == 1) return count;
      if (!AwaitTls(result, deadline)) return 0;
      continue;
    }
    const ssize_t count = recv(descriptor_, bytes, size, 0);
    if (count >= 0) return static_cast<size_t>(count);
    if (errno == EINTR) continue;
    if (errno != EAGAIN || !Await(descriptor_, POLLIN, deadline)) return 0;
  }
}

bool ClientSocket::Write(std::string_view bytes, Clock::time_point deadline) {
  while (!bytes.empty()) {
    if (ssl_ != nullptr) {
      ERR_clear_error();
      size_t count = 0;
      const int result = SSL_write_ex(ssl_.get(), bytes.data(), bytes.size(), &count);
      if (result == 1) {
        bytes.remove_prefix(count);
      } else if (!AwaitTls(result, deadline)) {
        return false;
      }
      continue;
    }
    const ssize_t count = send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count >= 0) {
      bytes.remove_prefix(static_cast<size_t>(count));
    } else if (errno != EINTR && (errno != EAGAIN || !Await(descriptor_, POLLOUT, deadline))) {
      return false;
    }
  }
  return true;
}

void ClientSocket::FinishWriting(Clock::time_point deadline) {
  if (ssl_ != nullptr && SSL_is_init_finished(ssl_.get())) {
    ERR_clear_error();
    while (true) {
      const int result = SSL_shutdown(ssl_.get());
      if (result >= 0 || !AwaitTls(result, deadline)) break;
    }
  }
  shutdown(descriptor_, SHUT_WR);
}

void ClientSocket::Shutdown() const { shutdown(descriptor_, SHUT_RDWR); }

std::string ClientSocket::Peer() const {
  const IpAddress peer = PeerOf(descriptor_);
  if (peer.host.empty()) return "unknown";
  if (peer.ipv6) return absl::StrCat("ipv6:[", peer.host, "]:", peer.port);
  return absl::StrCat("ipv4:", peer.host, ":", peer.port);
}

std::string ClientSocket::PeerHost() const { return PeerOf(descriptor_).host; }

std::string ClientSocket::LocalHost() const {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size) != 0) return "";
  const IpAddress local = ToIpAddress(address);
  return local.ipv6 ? absl::StrCat("[", local.host, "]") : local.host;
}

std::string ClientSocket::CertificateName() const {
  if (ssl_ == nullptr) return "";
  X509* const certificate = SSL_get0_peer_certificate(ssl_.get());
  if (certificate == nullptr) return "";
  X509_NAME* const subject = X509_get_subject_name(certificate);
  const int entry = X509_NAME_get_index_by_NID(subject, NID_commonName, -1);
  if (entry < 0) return "";
  unsigned char* text = nullptr;
  const int size =
      ASN1_STRING_to_UTF8(&text, X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, entry)));
  if (size < 0) return "";
  std::string name(reinterpret_cast<const char*>(text), static_cast<size_t>(size));
  OPENSSL_free(text);
  return absl::CEscape(name);
}

}  // namespace polyest::internal
