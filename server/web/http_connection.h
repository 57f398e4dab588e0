#pragma once

// Serves the requests of one connection, one after the other.

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "server/web/body_memory.h"
#include "server/web/client_socket.h"
#include "server/web/http_message.h"

namespace polyest::internal {

struct HttpLimits {
  // Bytes of a request's line and headers together; a header alone has at most 8 KiB.
  size_t head_bytes = size_t{64} << 10;
  size_t body_bytes = size_t{64} << 20;
  int requests = 1'000;  // of a connection
  // From one request to the next; also the time for the encryption to be agreed on.
  std::chrono::milliseconds idle{15'000};
  // For a whole head, from its first byte on.
  std::chrono::milliseconds head{10'000};
  // For a body or an answer, beside what it takes at `bytes_a_second`.
  std::chrono::milliseconds transfer{10'000};
  int64_t bytes_a_second = 64 << 10;
};

// Serves requests until the client closes the connection or breaks a limit, or the descriptor
// `stop` is readable between two of them. `memory` holds bodies.
void ServeConnection(ClientSocket& socket, int stop, const HttpLimits& limits, BodyMemory& memory,
                     const HttpHandler& handler);

}  // namespace polyest::internal
