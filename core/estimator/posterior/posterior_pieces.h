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
// The hyperplanes divide the design's element. A hyperplane's normal is Fisher's discriminant of
// the sets. The sets are found from pairs of minima of the cost, and are divided further in the
// same way.
//
// A posterior that is merely curved, skewed, heavy-tailed or a valley is one piece: it leaves no
// gap and has no such wall. A posterior with too few particles also counts as one piece.

#include <optional>
#include <vector>

#include "core/bayes/cost.h"
#include "core/estimator/expansion/expansion_design.h"

namespace polyest::internal {

// Least difference in cost between pieces and the wall that parts them: e^−8 ≈ 3·10⁻⁴.
inline constexpr double kMinWall = 8;

// Minimum number of particles for a division into pieces.
inline constexpr Eigen::Index kMinParticlesForPieces = 200;

// A part of an element, to be followed by a component of its own.
struct Piece {
  Element element;
  Region region;     // where its expansion begins
  Matrix particles;  // those of the posterior in it (W × n, germ coordinates); may be empty
  // −log of the density from which the particles were drawn, up to a constant; empty if unknown.
  Vector costs;
};

// Returns the pieces, or a single one if there are no others. `particles` (W × n, germ coordinates)
// are of the posterior on the design's expansion. Takes milliseconds.
std::vector<Piece> FindPieces(const Cost& cost, const ExpansionDesign& design,
                              const Matrix& particles);

// Returns particles of all components (each W × n, germ coordinates), in proportion to the
// components' weights (Σ = 1).
Matrix PooledParticles(const std::vector<Matrix>& particles, const std::vector<double>& weights);

// Returns a piece of all of Ω around the particles of all components (each W × n, germ
// coordinates), drawn from in proportion to the components' weights (Σ = 1), if a region around all
// of them has not much more volume than regions around each. Otherwise they are separate and
// nothing is returned.
std::optional<Piece> UnitePieces(const std::vector<Matrix>& particles,
                                 const std::vector<double>& weights);

}  // namespace polyest::internal
