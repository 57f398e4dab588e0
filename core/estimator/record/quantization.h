#pragma once

// Recognizes samples that are rounded to steps beside which their noise is small.
//
// Rounding to steps q is like white noise of q/√12 only where noise of at least about q/3, or the
// signal's own motion, takes successive samples to different steps (B. Widrow and I. Kollár,
// Quantization Noise, Cambridge University Press, 2008). Otherwise the same error, up to q/2, lasts
// as long as the signal stays within a step and comes back with it, and many samples tell no more
// than one. Noise s and rounding together have the variance s² + q²/12. If the signal is slow
// beside its noise, successive samples differ with the probability 2s/(√π q), averaged over the
// places within a step, so that the share of samples that differ tells s, too.

#include <optional>

#include "core/estimator/record/data_facts.h"

namespace polyest::internal {

struct CoarseSteps {
  double step = 0;   // q
  double noise = 0;  // s
};

// The noise of an output's samples, with their rounding.
struct RoundedNoise {
  double std_dev = 0;    // as it is assumed
  bool learned = false;  // whether it has been learned from the residuals
  // Root mean square of the residuals, if there is a fit. Without one, or where the model gives the
  // values themselves, two or three different values show no steps: they may be the states of a
  // switch.
  std::optional<double> residual = std::nullopt;
};

// Returns the steps of an output's samples if they are more than about three times the noise beside
// them, and some successive samples, 15 % or more, are equal.
std::optional<CoarseSteps> FindCoarseSteps(const ColumnFacts& column, const RoundedNoise& noise);

}  // namespace polyest::internal
