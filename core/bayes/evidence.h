#pragma once

// The evidence Z = ∫ p of an unnormalized density p, from draws of it, by bridge sampling with a
// Gaussian g with the draws' mean and covariance (a little wider):
//
//   Z = E_g[h p] / E_p[h g],   h = 1/(p/Z + g),
//
// a fixed point in Z; the points of g are quasi-random. The relative error is about √((1/B − 1)/N),
// with B the overlap of p and g: 10⁻² or better with 10⁴ points of each.
//
// Source: X.-L. Meng, W. H. Wong, Statistica Sinica 6 (1996).

#include <functional>

#include "core/common/types.h"

namespace polyest::internal {

// Writes log p at each row of `points` (W × n) into `values` (resized to W); −∞ where p is 0.
using LogDensity = std::function<void(const Matrix& points, Vector& values)>;

// Returns log Z; −∞ if the draws do not spread over all dimensions. `draws` is W × n, W ≥ 1; the
// weights are ≥ 0 with a positive sum, and log p must be finite where they are positive. The
// measure is that of the draws' coordinates.
double LogEvidence(const LogDensity& density, const Matrix& draws, const Vector& weights);

}  // namespace polyest::internal
