#include "core/model/input_generator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <type_traits>
#include <variant>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

template <class Input>
constexpr bool kIsSine =
    std::is_same_v<Input, SinusoidInput> || std::is_same_v<Input, HalfSineBumpInput>;
template <class Input>
constexpr bool kIsCurve = std::is_same_v<Input, TableInput> || std::is_same_v<Input, StreamedInput>;

double AngularFrequency(const SinusoidInput& input) {
  return 2 * std::numbers::pi * input.frequency_hz;
}
double AngularFrequency(const HalfSineBumpInput& input) {
  return std::numbers::pi / input.duration_s;
}

double Phase(const SinusoidInput& input, double time_s) {
  return AngularFrequency(input) * time_s + input.phase_rad;
}
double Phase(const HalfSineBumpInput& input, double time_s) {
  return std::numbers::pi * (time_s - input.start_s) / input.duration_s;
}

bool Acts(const SinusoidInput&, double) { return true; }
bool Acts(const HalfSineBumpInput& input, double time_s) {
  return time_s >= input.start_s && time_s < input.start_s + input.duration_s;
}

int SizeOfCurve(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::kHold:
      return 1;
    case Interpolation::kLinear:
      return 2;
    case Interpolation::kCubic:
    case Interpolation::kShapePreserving:
      return 4;
  }
  POLYEST_CHECK(false);
}

// Returns the derivatives 0 … 3 at a distance `tau` after knot `left` of the curve through knots.
std::array<double, 4> CurveDerivatives(const InputSignal& signal, size_t left, double tau,
                                       Interpolation interpolation) {
  const std::span<const double> time_s = signal.knot_times_s();
  const std::span<const double> value = signal.knot_values();
  const double h = time_s[left + 1] - time_s[left];
  const double chord = (value[left + 1] - value[left]) / h;
  if (interpolation == Interpolation::kLinear) return {value[left] + chord * tau, chord, 0, 0};
  const std::span<const double> slope = signal.knot_slopes();
  POLYEST_CHECK(left + 1 < slope.size());
  // u = u_l + s_l τ + b τ² + a τ³ with b = (3 δ − 2 s_l − s_r)/h and a = (s_l + s_r − 2 δ)/h²
  const double b = (3 * chord - 2 * slope[left] - slope[left + 1]) / h;
  const double a = (slope[left] + slope[left + 1] - 2 * chord) / (h * h);
  return {value[left] + (slope[left] + (b + a * tau) * tau) * tau,
          slope[left] + (2 * b + 3 * a * tau) * tau, 2 * b + 6 * a * tau, 6 * a};
}

void StateOfCurve(const InputSignal& signal, Interpolation interpolation, double time_s,
                  std::span<double> state) {
  const std::span<const double> knots = signal.knot_times_s();
  std::ranges::fill(state, 0.0);
  const auto next = std::upper_bound(knots.begin(), knots.end(), time_s);
  if (next == knots.begin() || next == knots.end() || interpolation == Interpolation::kHold) {
    state[0] = signal.Shape(time_s);
    return;
  }
  const auto left = static_cast<size_t>(next - knots.begin()) - 1;
  const std::array<double, 4> derivatives =
      CurveDerivatives(signal, left, time_s - knots[left], interpolation);
  std::copy_n(derivatives.begin(), state.size(), state.begin());
}

}  // namespace

int GeneratorSize(const InputSignal& signal) {
  return std::visit(
      []<class Input>(const Input& input) {
        if constexpr (kIsCurve<Input>) {
          return SizeOfCurve(input.interpolation);
        } else if constexpr (kIsSine<Input>) {
          return 2;
        } else {
          return std::is_same_v<Input, ChirpInput> ? 0 : 1;
        }
      },
      signal.specification());
}

Matrix GeneratorMatrix(const InputSignal& signal) {
  const int size = GeneratorSize(signal);
  Matrix matrix = Matrix::Zero(size, size);
  std::visit(
      [&]<class Input>(const Input& input) {
        if constexpr (kIsSine<Input>) {
          matrix(0, 1) = AngularFrequency(input);
          matrix(1, 0) = -AngularFrequency(input);
        } else {
          for (int k = 0; k + 1 < size; ++k) matrix(k, k + 1) = 1;
        }
      },
      signal.specification());
  return matrix;
}

void GeneratorState(const InputSignal& signal, double time_s, std::span<double> state) {
  std::visit(
      [&]<class Input>(const Input& input) {
        if constexpr (kIsCurve<Input>) {
          StateOfCurve(signal, input.interpolation, time_s, state);
        } else if constexpr (kIsSine<Input>) {
          const bool acts = Acts(input, time_s);
          state[0] = acts ? std::sin(Phase(input, time_s)) : 0;
          state[1] = acts ? std::cos(Phase(input, time_s)) : 0;
        } else {
          state[0] = signal.Shape(time_s);
        }
      },
      signal.specification());
}

}  // namespace polyest::internal
