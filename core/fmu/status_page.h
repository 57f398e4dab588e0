#pragma once

// Memory that a worker shares with the process that started it: which function of the FMU is being
// called, at which time, and what the FMU said last. It outlives a worker that crashes, and its
// counter tells one that is slow from one that hangs.

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
  std::atomic<uint64_t> calls;  // counts up with every call
  std::atomic<FmuCall> call;
  std::atomic<int32_t> point;  // the worker's own number of the trajectory
  std::atomic<double> time_s;
  std::array<char, 512> message;  // ends with a 0
};

// "doing a step"; of a number that is none of the calls, "in an unknown call".
const char* InWords(FmuCall call);

}  // namespace polyest::internal
