#include "core/bayes/differential_evolution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

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
  // Points outside, many where a posterior leans on bounds, are not evaluated at all.
  thread_local Matrix inside, xis;
  thread_local Vector inside_costs;
  thread_local std::vector<Eigen::Index> rows;
  xis.resize(etas.cols(), etas.rows());  // a point a column
  xis.noalias() = cost_.region().axes() * etas.transpose();
  xis.colwise() += cost_.region().centre();
  rows.clear();
  for (Eigen::Index i = 0; i < etas.rows(); ++i) {
    if (IsInBox(etas, i) && cost_.prior().Contains(xis.col(i))) rows.push_back(i);
  }
  if (std::ssize(rows) == etas.rows()) {
    cost_.EvaluateMany(etas, costs);
    return;
  }
  const auto count = std::ssize(rows);
  inside.resize(count, etas.cols());
  for (Eigen::Index k = 0; k < count; ++k) inside.row(k) = etas.row(rows[static_cast<size_t>(k)]);
  cost_.EvaluateMany(inside, inside_costs);
  costs.setConstant(etas.rows(), std::numeric_limits<double>::infinity());
  for (Eigen::Index k = 0; k < count; ++k) costs[rows[static_cast<size_t>(k)]] = inside_costs[k];
}

bool DifferentialEvolution::IsInBox(const Matrix& etas, Eigen::Index row) const {
  for (Eigen::Index j = 0; j < etas.cols(); ++j) {
    if (!(etas(row, j) >= lower_[j] && etas(row, j) <= upper_[j])) return false;
  }
  return true;
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
    if (change <= 0 || std::log(Uniform()) < -beta * change) {
      particles.etas.row(first + i) = proposal_.row(i);
      particles.costs[first + i] = proposal_costs_[i];
    }
  }
}

Eigen::Index DifferentialEvolution::Draw(Eigen::Index count) {
  return std::min(static_cast<Eigen::Index>(Uniform() * static_cast<double>(count)), count - 1);
}

}  // namespace polyest::internal
