#pragma once

// Excitations of a model: u(t) = amplitude · shape(t). The shape is the same for all values of the
// uncertain parameters; the amplitude may itself be uncertain ("force.amplitude").

#include <variant>
#include <vector>

namespace polyest {

// How a signal runs between its knots.
enum class Interpolation {
  kHold,             // the value of a knot until the next one
  kLinear,           // straight lines
  kCubic,            // a cubic spline through the knots nearby; smooth, may overshoot
  kShapePreserving,  // smooth cubics that never overshoot the knots (Fritsch and Butland)
};

// Amplitudes are in the unit of the model's input, times in s; all numbers must be finite.

// amplitude at all times.
struct ConstantInput {
  double amplitude = 0;  // in the input's unit
};

// 0 before time_s, amplitude from then on.
struct StepInput {
  double amplitude = 1;  // in the input's unit
  double time_s = 0;     // of the step
};

// amplitude · sin(2π f t + phase).
struct SinusoidInput {
  double amplitude = 1;     // in the input's unit
  double frequency_hz = 1;  // f > 0
  double phase_rad = 0;     // at t = 0
};

// amplitude · sin(2π (f0 τ + (f1 − f0) τ²/(2 T)) + phase), τ = t − start_s, for 0 ≤ τ < T, else 0.
struct ChirpInput {
  double amplitude = 1;             // in the input's unit
  double start_frequency_hz = 0.1;  // f0 ≥ 0
  double end_frequency_hz = 10;     // f1 ≥ 0
  double start_s = 0;               // where it begins
  double duration_s = 10;           // T > 0
  double phase_rad = 0;             // at its beginning
};

// amplitude · sin(π τ/T), τ = t − start_s, for 0 ≤ τ < T, else 0.
struct HalfSineBumpInput {
  double amplitude = 1;   // in the input's unit
  double start_s = 0;     // where it begins
  double duration_s = 1;  // T > 0
};

// amplitude · the curve through the knots; outside of them, the value of the nearest knot.
struct TableInput {
  std::vector<double> time_s;                            // at least one knot, strictly increasing
  std::vector<double> value;                             // one for each knot
  Interpolation interpolation = Interpolation::kLinear;  // between knots
  double amplitude = 1;  // multiplies the values, which are in the input's unit
};

// amplitude · the curve through values that come with the samples, in a column of the input's name
// (polyest/samples.h).
struct StreamedInput {
  Interpolation interpolation = Interpolation::kCubic;  // between samples
  double amplitude = 1;  // multiplies the values, which are in the input's unit
};

// What drives one input of a model.
using InputSpecification = std::variant<ConstantInput, StepInput, SinusoidInput, ChirpInput,
                                        HalfSineBumpInput, TableInput, StreamedInput>;

}  // namespace polyest
