#pragma once

// Draws of the posterior density ∝ e^{−J} by importance sampling from the curvature's Gaussian
// (A. Owen, A. Zhou, J. American Statistical Association 95, 2000: defensive mixtures).
//
// With the minimum η̂ and the Hessian H = L Lᵀ there, points η = η̂ + s L⁻ᵀ u with u standard normal
// have r² = ‖Lᵀ(η − η̂)‖² and the density q ∝ s⁻ⁿ e^{−r²/2s²}. The points are drawn from a mixture
// of two such densities, one a little wider than the Gaussian and one twice as wide, which bounds
// the weights where the posterior has heavier tails,
//   q ∝ Σ_c p_c s_c⁻ⁿ e^{−r²/2s_c²},   w ∝ e^{−J}/q,   s = s₁ and 2, p = 0.85 and 0.15,
// where s₁ = min(1.1, √(1 + 0.6/√n)) keeps the effective size from falling with the dimension n.
// The u are quasi-random: Halton's points mapped by the normal quantile. A mean over a nearly
// Gaussian posterior is therefore known far better than from as many random draws; the effective
// size 1/Σ w² (Σ w = 1) counts them as random and so is a lower bound.

#include "core/bayes/cost.h"
#include "core/common/types.h"

namespace polyest::internal {

struct WeightedDraws {
  Matrix etas;     // draws × n, local coordinates; only draws of positive weight
  Vector costs;    // J at each
  Vector weights;  // Σ = 1
  // 1/Σ w²; 0 if no point has a positive weight, and then there are no draws.
  double effective_size = 0;
};

// Returns log Σ_c p_c s_c⁻ⁿ e^{−r²/2s_c²} for each r².
Vector ProposalLogDensity(const Vector& squared_radii, int dimension);

// Scales standard normal points (any number × n) by s_1, the first p_1 of them, and by s_2.
void ScaleAsProposal(Matrix& points);

// Returns the draws among proposed points (any number × n) that have a positive weight, by the
// logarithms of the density from which the points were drawn, up to a common constant. `lower` and
// `upper` (n) bound the box outside which the density counts as 0.
WeightedDraws WeighProposed(const Cost& cost, const Vector& lower, const Vector& upper, Matrix etas,
                            const Vector& log_density);

// Draws `points` ≥ 100 points. `hessian_factor` is L (n × n), lower triangular with a positive
// diagonal; `lower` and `upper` (n) bound the box outside which the density counts as 0.
WeightedDraws ImportanceSample(const Cost& cost, const Vector& lower, const Vector& upper,
                               const ConstVectorRef& minimum, const ConstMatrixRef& hessian_factor,
                               int points);

}  // namespace polyest::internal
