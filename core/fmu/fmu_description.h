#pragma once

// The part of an FMU's modelDescription.xml (Functional Mock-up Unit, FMI 2.0 or 3.0) that is used:
// the quantities of the model, and the settings that a worker needs to run the binary.

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "polyest/model.h"

namespace polyest::internal {

enum class FmuKind : uint8_t { kModelExchange, kCoSimulation };

// A variable of type Real, Float64 or Float32.
struct FmuVariable {
  static constexpr int kNoState = -1;

  uint32_t reference = 0;  // FMI's value reference
  bool is_float32 = false;
  int state = kNoState;  // its index in the FMU's state vector if it is a continuous state
};

struct FmuInterface {
  int version = 2;  // FMI version, 2 or 3
  FmuKind kind = FmuKind::kModelExchange;
  std::string name;        // the FMU's name in the catalogue, for messages
  std::string identifier;  // the library's file name without .so
  std::string token;       // guid or instantiationToken
  int states = 0;          // number of continuous states
  // Whether the derivatives may depend on the time itself. They may unless the FMU declares the
  // independent variable and, for each derivative, dependencies without it.
  bool derivatives_use_time = true;
  int event_indicators = 0;
  bool needs_completed_step = false;  // whether it must be notified of each completed step
  bool once_per_process = false;      // whether a process can hold one instance only
  bool can_save_state = false;
  bool can_interpolate_inputs = false;
  bool can_vary_step = false;       // for Co-Simulation
  double communication_step_s = 0;  // for Co-Simulation, above 0
};

struct FmuDescription {
  FmuInterface interface;
  ModelDescription model;
  // In the order of the model's parameters, inputs and outputs.
  std::vector<FmuVariable> parameters;
  std::vector<FmuVariable> inputs;
  std::vector<FmuVariable> outputs;
};

// Communication step in s of a Co-Simulation FMU that does not specify one.
inline constexpr double kDefaultCommunicationStep = 1e-3;

// Parses the text of a modelDescription.xml. An FMU that offers both kinds is used for Model
// Exchange, which leaves the integration to polyest. Returns FailedPrecondition that states what is
// wrong or not supported.
absl::StatusOr<FmuDescription> ParseFmuDescription(const std::string& name, const std::string& xml);

// Returns the library's path in the archive: binaries/linux64/ID.so or binaries/x86_64-linux/ID.so.
std::string LibraryPath(const FmuInterface& interface);

// Returns the kind as text: "FMI 2.0 Model Exchange".
std::string KindInWords(const FmuInterface& interface);

}  // namespace polyest::internal
