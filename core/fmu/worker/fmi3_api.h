#pragma once

// The binary interface of the FMI 3.0 functions that are used. A status is 0 OK, 1 warning, 2
// discard, 3 error, 4 fatal.

#include <cstddef>
#include <cstdint>

namespace polyest::internal::fmi3 {

using Instance = void*;
using Reference = uint32_t;
using Status = int;
using State = void*;

using Log = void(void* environment, Status status, const char* category, const char* message);

using InstantiateModelExchange = Instance(const char* instance, const char* token,
                                          const char* resources_path, bool visible, bool logging,
                                          void* environment, Log* log);
// The last argument is a callback for intermediate values; they are not used.
using InstantiateCoSimulation = Instance(const char* instance, const char* token,
                                         const char* resources_path, bool visible, bool logging,
                                         bool event_mode_used, bool early_return_allowed,
                                         const Reference* intermediate_variables, size_t count,
                                         void* environment, Log* log, void* intermediate_update);
using EnterInitializationMode = Status(Instance, bool tolerance_defined, double tolerance,
                                       double start_time, bool stop_time_defined, double stop_time);
using Simple = Status(Instance);
template <class Float>
using Get = Status(Instance, const Reference* references, size_t count, Float* values,
                   size_t value_count);
template <class Float>
using Set = Status(Instance, const Reference* references, size_t count, const Float* values,
                   size_t value_count);
using GetState = Status(Instance, State* state);
using SetState = Status(Instance, State state);

using UpdateDiscreteStates = Status(Instance, bool* update_needed, bool* terminate,
                                    bool* nominals_changed, bool* states_changed,
                                    bool* next_event_time_defined, double* next_event_time);
using CompletedIntegratorStep = Status(Instance, bool no_set_state_before, bool* enter_event_mode,
                                       bool* terminate);
using SetTime = Status(Instance, double time);
using SetVector = Status(Instance, const double* values, size_t count);
using GetVector = Status(Instance, double* values, size_t count);

using DoStep = Status(Instance, double time, double step, bool no_set_state_before,
                      bool* event_needed, bool* terminate, bool* early_return,
                      double* last_successful_time);

}  // namespace polyest::internal::fmi3
