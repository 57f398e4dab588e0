#pragma once

// Draws of the posterior density ∝ e^{−J} by importance sampling from the curvature's Gaussian
// (A. Owen, A. Zhou, J. American Statistical Association 95, 2000: defensive mixtures).
//
// With the minimum η̂ and the Hessian H = L Lᵀ there, points η = η̂ + s L⁻ᵀ u with u standard normal
// have r² = ‖Lᵀ(η − η̂)‖² and the density q ∝ s⁻ⁿ e^{−r²/2s²}. They are drawn from a mixture of two,
// a little wider than the Gaussian and twice as wide, which bounds the weights where the posterior
// has heavier tails,
//   q ∝ Σ_c p_c s_c⁻ⁿ e^{−r²/2s_c²},   w ∝ e^{−J}/q,   s = 1.1 and 2, p = 0.85 and 0.15.
// The u are quasi-random: Halton's points through the normal quantile. So a mean over a nearly
// Gaussian posterior is far better known than from as many random draws; the effective size
// 1/Σ w² (Σ w = 1) counts as if they were random and is a bound to be on the safe side of.

#include "core/bayes/cost.h"
#include "core/common/types.h"

namespace polyest {

struct WeightedDraws {
  Matrix etas;     // draws × n, local coordinates, those of positive weight
  Vector costs;    // J at each
  Vector weights;  // Σ = 1
  // 1/Σ w²; 0 when no point has a weight, and then there are no draws.
  double effective_size = 0;
};

// hessian_factor: L (n × n), lower triangular with a positive diagonal. lower, upper: the box (n)
// outside which the density counts as 0. points ≥ 100.
WeightedDraws ImportanceSample(const Cost& cost, const Vector& lower, const Vector& upper,
                               const ConstVectorRef& minimum, const ConstMatrixRef& hessian_factor,
                               int points);

}  // namespace polyest
