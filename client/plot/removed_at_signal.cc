#include "client/plot/removed_at_signal.h"

#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <utility>

namespace polyest::internal {
namespace {

constexpr int kEndingSignals[] = {SIGHUP, SIGINT, SIGTERM};

// The file to remove; null: none.
std::atomic<const char*> signals_file = nullptr;
static_assert(std::atomic<const char*>::is_always_lock_free);  // as a handler needs

void RemoveAndEnd(int number) {
  if (const char* const file = signals_file) unlink(file);
  // The default action has been restored: the signal ends the process when the handler returns.
  raise(number);
}

// Replaces the action of the signals whose action is `from`.
void SetActions(void (*from)(int), void (*to)(int)) {
  for (const int number : kEndingSignals) {
    struct sigaction action = {};
    if (sigaction(number, nullptr, &action) != 0 || action.sa_handler != from) continue;
    action = {};
    action.sa_handler = to;
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(number, &action, nullptr);
  }
}

}  // namespace

RemovedAtSignal::RemovedAtSignal(std::string file) : file_(std::move(file)) {
  const char* none = nullptr;
  first_ = signals_file.compare_exchange_strong(none, file_.c_str());
  if (first_) SetActions(SIG_DFL, RemoveAndEnd);
}

RemovedAtSignal::~RemovedAtSignal() {
  if (!first_) return;
  SetActions(RemoveAndEnd, SIG_DFL);
  signals_file = nullptr;
}

}  // namespace polyest::internal
