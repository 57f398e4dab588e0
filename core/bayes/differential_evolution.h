#pragma once

// Differential evolution (C. ter Braak, Statistics and Computing 16, 2006): moves of a population
// of particles that leave a density ∝ e^{−βJ} invariant and need no tuning,
//   η_i + γ (η_j − η_k),   γ = 2.38/√(2n) times a lognormal factor, now and then γ = 1
// to jump between modes, accepted by Metropolis' rule. Differences within one half of a population
// move the other half, which leaves the density invariant although a whole half moves at once.
//
// By chance, halves move so in the coordinates u in which sums or products of parameters are
// straight (straight_coordinates.h), with the density ∝ e^{−βJ} |dη/du| there: differences do not
// point along a ridge that is curved.

#include <absl/random/gaussian_distribution.h>

#include <cstdint>
#include <random>
#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/straight_coordinates.h"
#include "core/common/types.h"

namespace polyest::internal {

struct Particles {
  Matrix etas;   // particles × n, in the cost's local coordinates
  Vector costs;  // J at each
};

class DifferentialEvolution {
 public:
  // `lower` and `upper` (n) bound the box that particles must not leave. All arguments must outlive
  // the object. The moves depend on the arguments alone.
  DifferentialEvolution(const Cost& cost, const Vector& lower, const Vector& upper, uint64_t seed);

  // Writes J at each row of `etas` into `costs`; +∞ outside the box and outside Ω.
  void Evaluate(const Matrix& etas, Vector& costs) const;
  // Moves each of the rows [first, first + count) once; they are a population of their own of at
  // least two particles.
  void Sweep(double beta, Eigen::Index first, Eigen::Index count, Particles& particles);

  double Uniform() { return uniform_(generator_); }  // in [0, 1)
  Eigen::Index Draw(Eigen::Index count);             // in [0, count)

 private:
  // Returns for each row of `etas` whether it is in the box and in Ω, 1 or 0; valid until the next
  // call.
  const std::vector<int64_t>& Allowed(const Matrix& etas) const;
  // The rows [first, first + count) move by differences of the rows [other, other + other_count).
  struct Halves {
    Eigen::Index first, count, other, other_count;
  };
  void MoveHalf(double beta, const Halves& halves, Particles& particles);
  // Returns which of `straight_` a half moves in, or more: in η. Half of the moves are in η, the
  // others in equal parts in each of the coordinates; but those of products that are curved by
  // choice alone take their share from the moves in η, not from those along sums.
  Eigen::Index DrawKind();
  // Write the points to which the half might move into `proposal_`. The second one does so by way
  // of u and writes the changes of log |dη/du| into `volume_changes_`.
  void Propose(const Halves& halves, const Matrix& etas);
  void ProposeIn(StraightCoordinates& coordinates, const Halves& halves, const Matrix& etas);
  double Factor(Eigen::Index dimension);  // γ

  const Cost& cost_;
  const Vector& lower_;
  const Vector& upper_;
  std::mt19937_64 generator_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  // By the ziggurat method, in a third of the time of std::normal_distribution.
  absl::gaussian_distribution<double> normal_{0, 1};
  std::vector<StraightCoordinates> straight_;  // those that are curved in η
  Matrix proposal_;
  Vector proposal_costs_;
  Matrix us_, signs_, moved_us_, other_us_;
  Vector volumes_, moved_volumes_, volume_changes_;
};

}  // namespace polyest::internal
