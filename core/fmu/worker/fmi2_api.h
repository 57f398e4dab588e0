#pragma once

// The binary interface of the FMI 2.0 functions that are used (Functional Mock-up Interface,
// sections 2 to 4 of the standard). A status is 0 OK, 1 warning, 2 discard, 3 error, 4 fatal, 5
// pending. A boolean is an int.

#include <cstddef>

namespace polyest::internal::fmi2 {

using Component = void*;
using Reference = unsigned int;
using Status = int;
using Boolean = int;
using State = void*;

inline constexpr int kTypeModelExchange = 0;
inline constexpr int kTypeCoSimulation = 1;

struct Callbacks {
  void (*log)(void* environment, const char* instance, Status status, const char* category,
              const char* message, ...);
  void* (*allocate)(size_t count, size_t size);
  void (*free)(void* memory);
  void (*step_finished)(void* environment, Status status);
  void* environment;
};

struct EventInfo {
  Boolean new_discrete_states_needed;
  Boolean terminate_simulation;
  Boolean nominals_changed;
  Boolean states_changed;
  Boolean next_event_time_defined;
  double next_event_time;
};

using Instantiate = Component(const char* instance, int type, const char* guid,
                              const char* resources_uri, const Callbacks* callbacks,
                              Boolean visible, Boolean logging);
using SetupExperiment = Status(Component, Boolean tolerance_defined, double tolerance,
                               double start_time, Boolean stop_time_defined, double stop_time);
using Simple = Status(Component);
using GetReal = Status(Component, const Reference* references, size_t count, double* values);
using SetReal = Status(Component, const Reference* references, size_t count, const double* values);
using GetState = Status(Component, State* state);
using SetState = Status(Component, State state);

using NewDiscreteStates = Status(Component, EventInfo* info);
using CompletedIntegratorStep = Status(Component, Boolean no_set_state_before,
                                       Boolean* enter_event_mode, Boolean* terminate);
using SetTime = Status(Component, double time);
using SetVector = Status(Component, const double* values, size_t count);
using GetVector = Status(Component, double* values, size_t count);

using SetInputDerivatives = Status(Component, const Reference* references, size_t count,
                                   const int* orders, const double* values);
using DoStep = Status(Component, double time, double step, Boolean no_set_state_before);

}  // namespace polyest::internal::fmi2
