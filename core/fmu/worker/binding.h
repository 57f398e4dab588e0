#pragma once

// An instance of an FMU, independent of the FMI version. Each function calls the corresponding FMI
// function and returns its status.

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/fmu/fmu_description.h"

namespace polyest::internal {

// The statuses as both versions of the standard number them. An FMU may return any other number.
inline constexpr int kFmuOk = 0, kFmuWarning = 1, kFmuDiscard = 2, kFmuError = 3, kFmuFatal = 4;

inline bool IsGood(int status) { return status == kFmuOk || status == kFmuWarning; }

struct EventUpdate {
  bool again = false;      // whether the discrete states need another iteration
  bool terminate = false;  // whether the FMU requests the end of the simulation
  bool next_time_defined = false;
  double next_time_s = 0;
};

// Receives the messages that an FMU logs.
using FmuLog = std::function<void(const std::string& message)>;

class Binding {
 public:
  virtual ~Binding() = default;

  // Sets up the experiment and enters the initialization mode, at t = 0.
  virtual int EnterInitialization(double tolerance) = 0;
  virtual int ExitInitialization() = 0;
  virtual int Set(std::span<const FmuVariable> variables, const double* values) = 0;
  virtual int Get(std::span<const FmuVariable> variables, double* values) = 0;
  // Saves the FMU state. `*state` is null at first; later calls overwrite the saved state.
  virtual int SaveState(void** state) = 0;
  virtual int RestoreState(void* state) = 0;

  // Functions for Model Exchange.
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

  // Functions for Co-Simulation.
  virtual int SetInputDerivatives(std::span<const FmuVariable> inputs, const double* rates) = 0;
  virtual int DoStep(double time_s, double step_s, bool& terminate) = 0;
};

// The loaded library of an FMU, with its functions resolved.
class FmuLibrary {
 public:
  virtual ~FmuLibrary() = default;
  // Returns a new instance, or nullptr when the FMU refuses. `log` must outlive the instance.
  virtual std::unique_ptr<Binding> Instantiate(const std::string& name, const FmuLog* log) = 0;
};

// Loads the library of an FMU of FMI 2.0 or 3.0. `resources` is the path of the FMU's resources
// folder. Returns FailedPrecondition when the library cannot be loaded or lacks a function.
absl::StatusOr<std::unique_ptr<FmuLibrary>> LoadFmi2(const FmuInterface& interface,
                                                     const std::string& library,
                                                     const std::string& resources);
absl::StatusOr<std::unique_ptr<FmuLibrary>> LoadFmi3(const FmuInterface& interface,
                                                     const std::string& library,
                                                     const std::string& resources);

}  // namespace polyest::internal
