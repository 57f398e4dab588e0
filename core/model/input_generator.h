#pragma once

// Input signals as solutions of linear systems with constant coefficients. Between two of its
// knots, a signal's shape is the first component of
//
//   w' = J w,   shape(t + τ) = w_0(τ),   w(0) = the signal's state at t.
//
// A piecewise polynomial of degree d has d + 1 components, its derivatives w_k = shape^(k), so J is
// the shift w_k' = w_{k+1}. A sinusoid of the angular frequency Ω and a half sine have w = (sin,
// cos), w_0' = Ω w_1, w_1' = −Ω w_0. A chirp solves no such system.

#include <span>

#include "core/common/types.h"
#include "core/model/input_signal.h"

namespace polyest::internal {

// Returns the number of components of w, at most 4; 0 if the signal solves no such system.
int GeneratorSize(const InputSignal& signal);

// Returns J, GeneratorSize × GeneratorSize, in 1/s.
Matrix GeneratorMatrix(const InputSignal& signal);

// Writes the signal's state at `time_s`, at a knot that on its right, into `state`, which has
// GeneratorSize elements. A streamed signal must be settled up to the next knot.
void GeneratorState(const InputSignal& signal, double time_s, std::span<double> state);

}  // namespace polyest::internal
