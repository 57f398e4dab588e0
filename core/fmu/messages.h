#pragma once

// The messages between a daemon and its workers over a socket. Each is preceded by its length in 8
// bytes. The daemon sends one StartMessage, then RequestMessages; the worker answers each of the
// latter with a ResultMessage.

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "core/common/types.h"
#include "core/fmu/codec.h"
#include "core/fmu/fmu_description.h"
#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

// Maximum length of a message in bytes; both sides refuse longer ones.
inline constexpr uint64_t kLongestMessage = uint64_t{1} << 30;

// One or more blocks of points, and the FMU that simulates them.
struct StartMessage {
  std::string library;    // path
  std::string resources;  // path
  FmuInterface interface;
  std::vector<FmuVariable> parameters;
  std::vector<FmuVariable> inputs;
  std::vector<FmuVariable> outputs;  // the outputs to read
  std::vector<int> block_points;     // number of points in each block
  // As in EnsembleSpecification, with the rows of the blocks stacked.
  Matrix parameter_values;
  Matrix amplitudes, input_delays_s, input_offsets;
  std::vector<InputSpecification> signals;
  IntegrationOptions integration;
};

// New knots of one streamed input.
struct KnotsMessage {
  int input = 0;
  std::vector<double> time_s;
  std::vector<double> value;
  bool finished = false;  // whether these are the last knots
};

struct AdvanceMessage {
  std::vector<KnotsMessage> knots;
  std::vector<double> times_s;
};

// Asks for values of the equations of an FMU for Model Exchange.
struct EvaluateMessage {
  enum class Values : uint8_t { kInitialStates, kDerivatives, kOutputs };

  Values values = Values::kDerivatives;
  double time_s = 0;
  std::vector<int> points;  // by row of the matrices: a row of StartMessage
  Matrix states;            // rows × states; not used for initial states
  Matrix inputs;            // rows × inputs
};

// A worker gets messages of one kind only.
using RequestMessage = std::variant<AdvanceMessage, EvaluateMessage>;

struct ResultMessage {
  // An error that ended the whole simulation: absl::StatusCode and the message; 0 without one.
  int code = 0;
  std::string error;
  // After AdvanceMessage: rows as in StartMessage, columns as in TrajectoryEnsemble::Advance. After
  // EvaluateMessage: the values, rows as there.
  Matrix outputs;
  // After AdvanceMessage: all so far; after EvaluateMessage: those of rows without values. `point`
  // is a row of StartMessage.
  std::vector<PointFailure> failures;
};

template <class Archive>
void Fields(Archive& archive, ConstantInput& input) {
  archive(input.amplitude);
}
template <class Archive>
void Fields(Archive& archive, StepInput& input) {
  archive(input.amplitude, input.time_s);
}
template <class Archive>
void Fields(Archive& archive, SinusoidInput& input) {
  archive(input.amplitude, input.frequency_hz, input.phase_rad);
}
template <class Archive>
void Fields(Archive& archive, ChirpInput& input) {
  archive(input.amplitude, input.start_frequency_hz, input.end_frequency_hz, input.start_s,
          input.duration_s, input.phase_rad);
}
template <class Archive>
void Fields(Archive& archive, HalfSineBumpInput& input) {
  archive(input.amplitude, input.start_s, input.duration_s);
}
template <class Archive>
void Fields(Archive& archive, TableInput& input) {
  archive(input.time_s, input.value, input.interpolation, input.amplitude);
}
template <class Archive>
void Fields(Archive& archive, StreamedInput& input) {
  archive(input.interpolation, input.amplitude);
}
template <class Archive>
void Fields(Archive& archive, IntegrationOptions& options) {
  archive(options.method, options.relative_tolerance, options.max_steps);
}
template <class Archive>
void Fields(Archive& archive, PointFailure& failure) {
  archive(failure.point, failure.time_s, failure.flag, failure.reason);
}
template <class Archive>
void Fields(Archive& archive, FmuVariable& variable) {
  archive(variable.reference, variable.is_float32, variable.state);
}
template <class Archive>
void Fields(Archive& archive, FmuInterface& interface) {
  archive(interface.version, interface.kind, interface.name, interface.identifier, interface.token,
          interface.states, interface.derivatives_use_time, interface.event_indicators,
          interface.needs_completed_step, interface.once_per_process, interface.can_save_state,
          interface.can_interpolate_inputs, interface.can_vary_step,
          interface.communication_step_s);
}
template <class Archive>
void Fields(Archive& archive, StartMessage& start) {
  archive(start.library, start.resources, start.interface, start.parameters, start.inputs,
          start.outputs, start.block_points, start.parameter_values, start.amplitudes,
          start.input_delays_s, start.input_offsets, start.signals, start.integration);
}
template <class Archive>
void Fields(Archive& archive, KnotsMessage& knots) {
  archive(knots.input, knots.time_s, knots.value, knots.finished);
}
template <class Archive>
void Fields(Archive& archive, AdvanceMessage& advance) {
  archive(advance.knots, advance.times_s);
}
template <class Archive>
void Fields(Archive& archive, EvaluateMessage& evaluate) {
  archive(evaluate.values, evaluate.time_s, evaluate.points, evaluate.states, evaluate.inputs);
}
template <class Archive>
void Fields(Archive& archive, ResultMessage& result) {
  archive(result.code, result.error, result.outputs, result.failures);
}

// Returns a message as bytes.
template <class Message>
std::string Encode(const Message& message) {
  Encoder encoder;
  encoder(message);
  return encoder.TakeBytes();
}

}  // namespace polyest::internal
