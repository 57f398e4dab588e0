#pragma once

// Noise whose standard deviation is a function of the prediction y, σ(y). With R = σ² + ρ (ρ does
// not depend on y) and e = z − y, −log of the likelihood of a sample and its derivatives are
//   f  = ½ e²/R + ½ log R,   f′ = −e/R − g (e²/R − 1),   g = σσ′/R,   E[f″] = 1/R + 2 g²,
// so that a step of Fisher's scoring from y is that of least squares with
//   the variance R* = 1/(1/R + 2 g²) and the sample z* = y − f′ R*.
// Repeated from its own minimum, it ends at the minimum of f.
//
// Taken of the sample instead, σ(z) gives small samples too much weight: for σ = r |z| the estimate
// is too small by the fraction 2 r².
//
// Source: McCullagh & Nelder, Generalized Linear Models (1989), §2.5 and ch. 10.

#include <algorithm>

namespace polyest::internal {

// A sample as least squares is to see it.
struct ScoredSample {
  double value = 0;           // z*
  double noise_variance = 0;  // R* − ρ
  double lack = 0;  // f(y) − ½ log R − ½ (z* − y)²/R*, what least squares leaves out
};

// Returns the sample z with the prediction `y`, the noise σ² = `variance` there, σ′ = `slope`·σ and
// ρ = `own_error`.
inline ScoredSample Score(double z, double y, double variance, double slope, double own_error) {
  const double total = variance + own_error;
  const double error = z - y;
  const double g = slope * variance / total;
  const double scored = 1 / (1 / total + 2 * g * g);
  const double score = error / total + g * (error * error / total - 1);
  // R* is less than R by less than 2 σ²σ′², which is more than σ² only for nonsensical noise.
  return {y + score * scored, std::max(scored - own_error, 0.25 * variance),
          0.5 * (error * error / total - score * score * scored)};
}

}  // namespace polyest::internal
