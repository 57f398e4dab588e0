#pragma once

// Finds well-separated pieces of a posterior from its particles and its cost on an expansion.
//
// Two sets of particles are separate pieces when a hyperplane passes between them such that
// - no particle lies near it: along its normal the sets leave a gap of at least one standard
//   deviation of the particles about their own set's mean,
// - each set has at least 2 % of the particles,
// - the cost on it is everywhere at least 8 above the higher of the two sides' least costs: every
//   path from one piece to the other passes through a density below e^−8 of either peak.
//
// The hyperplane's normal is Fisher's discriminant of the sets. The sets are found from pairs of
// minima of the cost, and are divided further in the same way.
//
// A posterior that is merely curved, skewed, heavy-tailed or a valley is one piece: it leaves no
// gap and has no such wall. A posterior with too few particles also counts as one piece.

#include <vector>

#include "core/bayes/cost.h"
#include "core/estimator/expansion/expansion_design.h"

namespace polyest::internal {

// Minimum number of particles for a division into pieces.
inline constexpr Eigen::Index kMinParticlesForPieces = 200;

// Returns the particles of each piece, or all particles as one piece if there are no others.
// `particles` (W × n, germ coordinates) are of the posterior on the design's expansion. Takes
// milliseconds.
std::vector<Matrix> FindPieces(const Cost& cost, const ExpansionDesign& design,
                               const Matrix& particles);

}  // namespace polyest::internal
