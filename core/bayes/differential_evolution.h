#pragma once

// Moves that leave a density ∝ e^{−βJ} invariant, without any tuning, from a population of
// particles: differential evolution (C. ter Braak, Statistics and Computing 16, 2006),
//   η_i + γ (η_j − η_k),   γ = 2.38/√(2n) times a lognormal factor, now and then γ = 1
// to jump between separate pieces, accepted by Metropolis' rule. Each half of a population is moved
// by differences within the other, which leaves the density invariant though all of a half move at
// once.

#include <cstdint>
#include <random>

#include "core/bayes/cost.h"
#include "core/common/types.h"

namespace polyest {

struct Particles {
  Matrix etas;   // particles × n, in the cost's local coordinates
  Vector costs;  // J at each
};

class DifferentialEvolution {
 public:
  // lower, upper: the box (n) that particles must not leave. All must outlive it. What it does is
  // a function of its arguments alone.
  DifferentialEvolution(const Cost& cost, const Vector& lower, const Vector& upper, uint64_t seed);

  // J at each row; +∞ outside the box.
  void Evaluate(const Matrix& etas, Vector& costs) const;
  // One move of each of the rows [first, first + count), a population of its own of at least two.
  void Sweep(double beta, Eigen::Index first, Eigen::Index count, Particles& particles);

  double Uniform() { return uniform_(generator_); }  // in [0, 1)
  Eigen::Index Draw(Eigen::Index count);             // in [0, count)

 private:
  void MoveHalf(double beta, Eigen::Index first, Eigen::Index count, Eigen::Index other,
                Eigen::Index other_count, Particles& particles);

  const Cost& cost_;
  const Vector& lower_;
  const Vector& upper_;
  std::mt19937_64 generator_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::normal_distribution<double> normal_{0, 1};
  Matrix proposal_;
  Vector proposal_costs_;
};

}  // namespace polyest
