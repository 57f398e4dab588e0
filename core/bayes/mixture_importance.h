#pragma once

// Draws of a posterior density ∝ e^{−J} with several modes by importance sampling from a mixture of
// Gaussians, one at each minimum of J. Each Gaussian is itself a mixture of two, a little wider and
// twice as wide (importance.h):
//   q ∝ Σ_m π_m det L_m Σ_c p_c s_c⁻ⁿ e^{−r_m²/2s_c²},   r_m = ‖L_mᵀ(η − η̂_m)‖,   w ∝ e^{−J}/q.
// The weights of the modes come out by themselves, whatever shares π_m of the points they are
// given: no point has to find its way from one mode to another.
//
// Shares, centres and factors can be adapted to the weighted draws and the sampling be repeated
// (O. Cappé, R. Douc, A. Guillin, J.-M. Marin, C. Robert, Adaptive importance sampling in general
// mixture classes, Statistics and Computing 18, 2008, 447–459), for modes that are not where their
// curvature says or not as wide.

#include <vector>

#include "core/bayes/importance.h"
#include "core/common/types.h"

namespace polyest::internal {

struct GaussianMode {
  Vector centre;         // η̂ (n), local coordinates
  Matrix factor;         // L (n × n), lower triangular with a positive diagonal; precision L Lᵀ
  double log_share = 0;  // log π, up to a constant that all modes have in common
};

// Returns the Gaussian at a minimum of J whose Hessian is L Lᵀ, with the share that Laplace's
// approximation gives it, e^{−J}/det L.
GaussianMode ModeAt(const Vector& minimum, double cost, const Matrix& hessian_factor);

// Returns the Gaussian with the mean and the covariance of the modes' mixture. Its points lie
// between and around the modes, where each of them alone has hardly any.
GaussianMode AroundAll(const std::vector<GaussianMode>& modes);

// Draws about `points` ≥ 100 points from the mixture of the modes, at least one. A tenth of the
// points are dealt to the modes in equal parts. `lower` and `upper` (n) bound the box outside
// which the density counts as 0. The draws depend on the arguments alone.
WeightedDraws ImportanceSample(const Cost& cost, const Vector& lower, const Vector& upper,
                               const std::vector<GaussianMode>& modes, int points);

// Returns the modes with the shares, means and covariances that the draws have, each draw being
// dealt to the modes in proportion to their densities at it. The weights are cut at N^{−1/2} for N
// draws (E. Ionides, J. Computational and Graphical Statistics 17, 2008), and the moments are
// mixed with the present ones, which count as much as ten draws for each dimension.
std::vector<GaussianMode> AdaptedTo(const WeightedDraws& draws,
                                    const std::vector<GaussianMode>& modes);

}  // namespace polyest::internal
