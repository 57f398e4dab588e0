#pragma once

// Well separated pieces of a posterior, from particles of it and its cost on an expansion.
//
// Two sets of particles are pieces of their own when a hyperplane passes between them such that
// - no particle lies near it: along its normal they leave a gap of at least one standard deviation
//   of the particles about their own set's mean,
// - either set has at least 2 % of the particles,
// - the cost is nowhere on it less than 8 above the higher of the least costs on both sides: every
//   way from one piece to the other passes where the density is below e^−8 of either's peak.
// The hyperplane's normal is Fisher's discriminant of the sets. They are found from pairs of minima
// of the cost, and divided further in the same way.
//
// A posterior that is merely curved, skewed, heavy-tailed or a valley is one piece: it leaves no
// gap and has no such wall. So is one too poorly sampled to tell.

#include <vector>

#include "core/bayes/cost.h"
#include "core/estimator/expansion/expansion_design.h"

namespace polyest::internal {

// Below this no pieces are told apart.
inline constexpr Eigen::Index kMinParticlesForPieces = 200;

// particles: W × n, germ coordinates, of the posterior on the design's expansion. Each piece's own;
// one piece, all of them, when there are no others. A matter of milliseconds.
std::vector<Matrix> FindPieces(const Cost& cost, const ExpansionDesign& design,
                               const Matrix& particles);

}  // namespace polyest::internal
