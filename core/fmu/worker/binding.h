#pragma once

// One instance of an FMU, whatever the version of FMI: its functions one to one. Each answers a
// status as the standard numbers them: 0 OK, 1 warning, 2 discard, 3 error, 4 fatal.

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/fmu/fmu_description.h"

namespace polyest::internal {

struct EventUpdate {
  bool again = false;      // the discrete states want another iteration
  bool terminate = false;  // the FMU wants the simulation to end
  bool next_time_defined = false;
  double next_time_s = 0;
};

// What an FMU says.
using FmuLog = std::function<void(int status, const std::string& message)>;

class Binding {
 public:
  virtual ~Binding() = default;

  // Setup and entry of the initialization mode, at t = 0.
  virtual int EnterInitialization(double tolerance) = 0;
  virtual int ExitInitialization() = 0;
  virtual int Set(std::span<const FmuVariable> variables, const double* values) = 0;
  virtual int Get(std::span<const FmuVariable> variables, double* values) = 0;
  // An FMU state; null to begin with, replaced after that.
  virtual int SaveState(void** state) = 0;
  virtual int RestoreState(void* state) = 0;
  virtual int FreeState(void** state) = 0;

  // Model Exchange.
  virtual int EnterEventMode() = 0;
  virtual int UpdateDiscreteStates(EventUpdate& update) = 0;
  virtual int EnterContinuousTime() = 0;
  virtual int CompletedStep(bool& enter_event_mode, bool& terminate) = 0;
  virtual int SetTime(double time_s) = 0;
  virtual int SetStates(std::span<const double> states) = 0;
  virtual int GetStates(std::span<double> states) = 0;
  virtual int GetNominals(std::span<double> nominals) = 0;
  virtual int GetDerivatives(std::span<double> derivatives) = 0;
  virtual int GetEventIndicators(std::span<double> indicators) = 0;

  // Co-Simulation.
  virtual int SetInputDerivatives(std::span<const FmuVariable> inputs, const double* rates) = 0;
  virtual int DoStep(double time_s, double step_s, bool& terminate) = 0;
};

// An FMU's library, its functions found.
class FmuLibrary {
 public:
  virtual ~FmuLibrary() = default;
  // A new instance; null when the FMU refuses. `log` must outlive it.
  virtual std::unique_ptr<Binding> Instantiate(const std::string& name, const FmuLog* log) = 0;
};

// FAILED_PRECONDITION when the library cannot be loaded or lacks a function. `resources` is the
// path of the folder of that name.
absl::StatusOr<std::unique_ptr<FmuLibrary>> LoadFmi2(const FmuInterface& interface,
                                                     const std::string& library,
                                                     const std::string& resources);
absl::StatusOr<std::unique_ptr<FmuLibrary>> LoadFmi3(const FmuInterface& interface,
                                                     const std::string& library,
                                                     const std::string& resources);

}  // namespace polyest::internal
