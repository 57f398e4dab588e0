#pragma once

// What the modelDescription.xml of an FMU (Functional Mock-up Unit, FMI 2.0 or 3.0) says, as far as
// it is used: the quantities as any other model's, and what a worker needs to drive the binary.

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "polyest/model.h"

namespace polyest::internal {

enum class FmuKind : uint8_t { kModelExchange, kCoSimulation };

// A variable of type Real, Float64 or Float32.
struct FmuVariable {
  uint32_t reference = 0;  // the value reference
  bool is_float32 = false;
};

struct FmuInterface {
  int version = 2;  // of FMI: 2 or 3
  FmuKind kind = FmuKind::kModelExchange;
  std::string name;        // of the FMU in the catalogue, for messages
  std::string identifier;  // the library's name without .so
  std::string token;       // guid or instantiationToken
  int states = 0;          // continuous ones
  int event_indicators = 0;
  bool needs_completed_step = false;  // wants to hear of each integrator step
  bool once_per_process = false;      // one instance a process only
  bool can_save_state = false;
  bool can_interpolate_inputs = false;
  bool can_vary_step = false;       // of Co-Simulation
  double communication_step_s = 0;  // of Co-Simulation; > 0
};

struct FmuDescription {
  FmuInterface interface;
  ModelDescription model;
  // In the order of the model's parameters, inputs and outputs.
  std::vector<FmuVariable> parameters;
  std::vector<FmuVariable> inputs;
  std::vector<FmuVariable> outputs;
};

// The communication step of a Co-Simulation FMU that names none, in s.
inline constexpr double kDefaultCommunicationStep = 1e-3;

// Reads the text of a modelDescription.xml. An FMU that offers both kinds is taken for Model
// Exchange, so that the integrator is ours. FAILED_PRECONDITION says what is wrong or not
// supported.
absl::StatusOr<FmuDescription> ParseFmuDescription(const std::string& name, const std::string& xml);

// The library's path in the archive: binaries/linux64/ID.so or binaries/x86_64-linux/ID.so.
std::string LibraryPath(const FmuInterface& interface);

// "FMI 2.0 Model Exchange".
std::string KindInWords(const FmuInterface& interface);

}  // namespace polyest::internal
