#include "server/daemon/health_dial.h"

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/types.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

namespace polyest::internal {
namespace {

using Clock = std::chrono::steady_clock;

// Frames of HTTP/2 (RFC 9113, 6).
enum Kind : unsigned char { kData = 0, kHeaders = 1, kSettings = 4 };
constexpr unsigned char kEndStream = 1;
constexpr unsigned char kEndHeaders = 4;
constexpr size_t kFrameHead = 9;

std::string Frame(Kind kind, unsigned char flags, unsigned char stream,
                  const std::string& payload) {
  std::string frame(3, '\0');
  frame[1] = static_cast<char>(payload.size() >> 8);
  frame[2] = static_cast<char>(payload.size() & 0xFF);
  frame += static_cast<char>(kind);
  frame += static_cast<char>(flags);
  frame += std::string(3, '\0');
  frame += static_cast<char>(stream);
  return frame + payload;
}

// Returns a header as a literal field without indexing (RFC 7541, 6.2.2). Both parts have fewer
// than 127 bytes.
std::string Header(const std::string& name, const std::string& value) {
  return std::string(1, '\0') + static_cast<char>(name.size()) + name +
         static_cast<char>(value.size()) + value;
}

std::string HealthCall() {
  const std::string headers = Header(":method", "POST") + Header(":scheme", "http") +
                              Header(":authority", "localhost") +
                              Header(":path", "/grpc.health.v1.Health/Check") +
                              Header("te", "trailers") + Header("content-type", "application/grpc");
  // An empty message: it is not compressed and has no bytes.
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + Frame(kSettings, 0, 0, "") +
         Frame(kHeaders, kEndHeaders, 1, headers) + Frame(kData, kEndStream, 1, std::string(5, 0));
}

// Waits until a socket is ready. Returns false at the deadline.
bool Await(int socket, short event, Clock::time_point deadline) {
  const auto left =
      std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
  pollfd wait{socket, event, 0};
  return left > 0 && poll(&wait, 1, static_cast<int>(left)) == 1;
}

// Removes whole frames from the front of `bytes`. Returns whether one of them has the headers of
// the answer.
bool TakeAnswer(std::string& bytes) {
  while (bytes.size() >= kFrameHead) {
    const auto at = [&](size_t i) {
      return static_cast<size_t>(static_cast<unsigned char>(bytes[i]));
    };
    const size_t size = (at(0) << 16) + (at(1) << 8) + at(2);
    if (bytes.size() < kFrameHead + size) return false;
    if (at(3) == kHeaders && at(8) == 1) return true;
    bytes.erase(0, kFrameHead + size);
  }
  return false;
}

}  // namespace

std::vector<sockaddr_storage> AddressesToDial(const sockaddr_storage& address) {
  std::vector<sockaddr_storage> addresses{address};
  auto& four = reinterpret_cast<sockaddr_in&>(addresses.front());
  auto& six = reinterpret_cast<sockaddr_in6&>(addresses.front());
  if (address.ss_family == AF_INET && four.sin_addr.s_addr == htonl(INADDR_ANY)) {
    four.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  } else if (address.ss_family == AF_INET6 && IN6_IS_ADDR_UNSPECIFIED(&six.sin6_addr)) {
    addresses.push_back(address);
    reinterpret_cast<sockaddr_in6&>(addresses.front()).sin6_addr = in6addr_loopback;
    auto& mapped = reinterpret_cast<sockaddr_in6&>(addresses.back()).sin6_addr;
    mapped = {};
    mapped.s6_addr[10] = mapped.s6_addr[11] = 0xFF;
    const in_addr_t loopback = htonl(INADDR_LOOPBACK);
    std::memcpy(&mapped.s6_addr[12], &loopback, sizeof(loopback));
  }
  return addresses;
}

bool AnswersHealthCall(int socket, Clock::time_point deadline) {
  const std::string call = HealthCall();
  if (!Await(socket, POLLOUT, deadline) ||
      send(socket, call.data(), call.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(call.size())) {
    return false;
  }
  std::string bytes;
  char buffer[4'096];
  while (Await(socket, POLLIN, deadline)) {
    const ssize_t count = recv(socket, buffer, sizeof(buffer), 0);
    if (count <= 0) return false;
    bytes.append(buffer, static_cast<size_t>(count));
    if (TakeAnswer(bytes)) return true;
  }
  return false;
}

}  // namespace polyest::internal
