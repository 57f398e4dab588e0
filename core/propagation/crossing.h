#pragma once

// Finds where a function that was sampled over a step first becomes positive.

#include <array>

namespace polyest::internal {

// Values at θ = 0, ¼, ½, ¾ and 1.
using StepSamples = std::array<double, 5>;

struct Crossing {
  bool found = false;
  double theta = 0;  // where the function becomes positive
  double slope = 0;  // dφ/dθ there
};

// Returns the first θ in [0, 1] from which on the polynomial of degree 4 through the samples is
// positive. With `from_zero` the function starts at 0, whatever its first sample; it then counts as
// positive at the start only if it is positive throughout the samples that follow.
//
// The polynomial is taken in Bernstein's form. It lies in the convex hull of its coefficients, so
// that no crossing is missed, however short the time between it and the crossing back. Where a
// sample is not finite there is no polynomial; the first sample that is positive counts then.
Crossing FirstCrossing(const StepSamples& samples, bool from_zero);

// Returns the value at θ of the polynomial of degree 4 through the samples.
double Interpolate(const StepSamples& samples, double theta);

}  // namespace polyest::internal
