#include "core/bayes/differential_evolution.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

constexpr double kJumpProbability = 0.1;  // of a move with γ = 1
constexpr double kStepSpread = 0.5;       // standard deviation of log γ
constexpr double kJitter = 1e-6;          // keeps the moves irreducible, in box widths

}  // namespace

DifferentialEvolution::DifferentialEvolution(const Cost& cost, const Vector& lower,
                                             const Vector& upper, uint64_t seed)
    : cost_(cost), lower_(lower), upper_(upper), generator_(seed) {}

void DifferentialEvolution::Evaluate(const Matrix& etas, Vector& costs) const {
  cost_.EvaluateMany(etas, costs);
  for (Eigen::Index i = 0; i < etas.rows(); ++i) {
    const auto row = etas.row(i).transpose().array();
    if ((row < lower_.array()).any() || (row > upper_.array()).any()) {
      costs[i] = std::numeric_limits<double>::infinity();
    }
  }
}

void DifferentialEvolution::Sweep(double beta, Eigen::Index first, Eigen::Index count,
                                  Particles& particles) {
  const Eigen::Index half = count / 2;
  MoveHalf(beta, first, half, first + half, count - half, particles);
  MoveHalf(beta, first + half, count - half, first, half, particles);
}

void DifferentialEvolution::MoveHalf(double beta, Eigen::Index first, Eigen::Index count,
                                     Eigen::Index other, Eigen::Index other_count,
                                     Particles& particles) {
  const Eigen::Index n = particles.etas.cols();
  const double scale = 2.38 / std::sqrt(2.0 * static_cast<double>(n));
  proposal_.resize(count, n);
  for (Eigen::Index i = 0; i < count; ++i) {
    const bool jump = Uniform() < kJumpProbability;
    const double gamma = jump ? 1 : scale * std::exp(kStepSpread * normal_(generator_));
    const Eigen::Index j = other + Draw(other_count);
    const Eigen::Index k = other + Draw(other_count);
    for (Eigen::Index d = 0; d < n; ++d) {
      proposal_(i, d) = particles.etas(first + i, d) +
                        gamma * (particles.etas(j, d) - particles.etas(k, d)) +
                        kJitter * (upper_[d] - lower_[d]) * normal_(generator_);
    }
  }
  Evaluate(proposal_, proposal_costs_);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double change = proposal_costs_[i] - particles.costs[first + i];
    if (std::log(Uniform()) < -beta * change) {
      particles.etas.row(first + i) = proposal_.row(i);
      particles.costs[first + i] = proposal_costs_[i];
    }
  }
}

Eigen::Index DifferentialEvolution::Draw(Eigen::Index count) {
  return std::min(static_cast<Eigen::Index>(Uniform() * static_cast<double>(count)), count - 1);
}

}  // namespace polyest::internal
