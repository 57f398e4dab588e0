#pragma once

#include <sys/socket.h>

#include <chrono>
#include <vector>

namespace polyest::internal {

// Returns the addresses at which a client on this machine reaches a socket that listens on
// `address`, of which the machine may lack all but the last: where it has no ::1, a socket of all
// addresses is reached by IPv4.
std::vector<sockaddr_storage> AddressesToDial(const sockaddr_storage& address);

// Calls the health service over a connected socket as an HTTP/2 client does. Returns whether any
// answer to the call comes before the deadline.
bool AnswersHealthCall(int socket, std::chrono::steady_clock::time_point deadline);

}  // namespace polyest::internal
