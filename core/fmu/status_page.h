#pragma once

// Memory that a worker shares with the process that started it. It holds the FMU function that is
// being called, the simulation time of the call, and the FMU's last message. It survives a crash of
// the worker, and its counter of calls distinguishes a slow worker from one that hangs.

#include <array>
#include <atomic>
#include <cstdint>

namespace polyest::internal {

enum class FmuCall : int32_t {
  kNothing,
  kLoad,
  kInstantiate,
  kInitialize,
  kSetVariables,
  kGetVariables,
  kDerivatives,
  kEvents,
  kStep,
  kState,
  kEnd,
};

struct StatusPage {
  std::atomic<uint64_t> calls;  // number of calls so far
  std::atomic<FmuCall> call;
  std::atomic<double> time_s;
  std::array<char, 512> message;  // zero-terminated
};

// Returns the call as text, such as "doing a step", or "in an unknown call" for a value that is not
// in FmuCall.
const char* InWords(FmuCall call);

}  // namespace polyest::internal
