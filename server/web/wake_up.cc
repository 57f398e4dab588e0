#include "server/web/wake_up.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <system_error>

#include "core/common/check.h"

namespace polyest::internal {

WakeUp::WakeUp() : event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (event_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

WakeUp::~WakeUp() { close(event_); }

void WakeUp::Signal() const {
  const uint64_t one = 1;
  (void)!write(event_, &one, sizeof(one));
}

void WakeUp::Clear() const {
  uint64_t count = 0;
  (void)!read(event_, &count, sizeof(count));
}

namespace {

// The events of a client's socket that tell of its end.
bool TellsOfEnd(const pollfd& client) {
  return (client.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
}

}  // namespace

bool WakeUp::IsGone(int client) {
  pollfd looked{client, POLLRDHUP, 0};
  return poll(&looked, 1, 0) > 0 && TellsOfEnd(looked);
}

WakeUp::Reason WakeUp::Await(int client, Clock::time_point deadline) const {
  constexpr int64_t kLongestMs = 60'000;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
  if (left <= 0) return Reason::kTimeout;
  pollfd waiting[] = {{event_, POLLIN, 0}, {client, POLLRDHUP, 0}};
  const int happened = poll(waiting, 2, static_cast<int>(std::min(left, kLongestMs)));
  POLYEST_CHECK(happened >= 0 || errno == EINTR);
  const bool gone = happened > 0 && TellsOfEnd(waiting[1]);
  return gone ? Reason::kClientGone : Reason::kSignal;
}

}  // namespace polyest::internal
