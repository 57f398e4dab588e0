#pragma once

// The evidence Z = ∫ p of a density p known up to that constant, from draws of it, by bridge
// sampling with a Gaussian g of the draws' mean and covariance (a little wider):
//
//   Z = E_g[h p] / E_p[h g],   h = 1/(p/Z + g),
//
// a fixed point in Z; the points of g are quasi-random. Its relative error is about
// √((1/B − 1)/N) with B the overlap of the two, 10⁻² or better from 10⁴ of each.
//
// Source: X.-L. Meng, W. H. Wong, Statistica Sinica 6 (1996).

#include <functional>

#include "core/common/types.h"

namespace polyest {

// log p at each row of points (W × n); −∞ where p is 0. values is W (resized).
using LogDensity = std::function<void(const Matrix& points, Vector& values)>;

// log Z. draws is W × n, W ≥ 1, with weights ≥ 0 of a positive sum; log p must be finite where they
// are positive. The measure is that of the draws' own coordinates. −∞ when the draws do not spread
// over all dimensions.
double LogEvidence(const LogDensity& density, const Matrix& draws, const Vector& weights);

}  // namespace polyest
