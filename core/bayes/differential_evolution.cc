#include "core/bayes/differential_evolution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace polyest::internal {
namespace {

constexpr double kJumpProbability = 0.1;  // of a move with γ = 1
constexpr double kStepSpread = 0.5;       // standard deviation of log γ
constexpr double kBothSigns = 0.5;        // probability of logarithms where there are both signs
constexpr double kJitter = 1e-6;          // keeps the moves irreducible, in box widths

}  // namespace

DifferentialEvolution::DifferentialEvolution(const Cost& cost, const Vector& lower,
                                             const Vector& upper, uint64_t seed)
    : cost_(cost), lower_(lower), upper_(upper), generator_(seed) {
  for (const ParameterMap map : {ParameterMap::kAffine, ParameterMap::kExponential}) {
    const StraightCoordinates coordinates(cost.prior(), cost.region(), map);
    if (coordinates.curved()) straight_.push_back(coordinates);
  }
}

void DifferentialEvolution::Evaluate(const Matrix& etas, Vector& costs) const {
  // Points outside, many where a posterior leans on bounds, are not evaluated at all.
  thread_local Matrix inside;
  thread_local Vector inside_costs;
  thread_local std::vector<Eigen::Index> rows;
  const std::vector<int64_t>& allowed = Allowed(etas);
  rows.clear();
  for (Eigen::Index i = 0; i < etas.rows(); ++i) {
    if (allowed[static_cast<size_t>(i)] != 0) rows.push_back(i);
  }
  if (std::ssize(rows) == etas.rows()) {
    cost_.EvaluateMany(etas, costs);
    return;
  }
  inside = etas(rows, Eigen::all);
  cost_.EvaluateMany(inside, inside_costs);
  costs.setConstant(etas.rows(), std::numeric_limits<double>::infinity());
  costs(rows) = inside_costs;
}

const std::vector<int64_t>& DifferentialEvolution::Allowed(const Matrix& etas) const {
  thread_local Matrix xis;
  thread_local std::vector<int64_t> allowed;  // as wide as a number, for the processor's vectors
  xis.resize(etas.rows(), etas.cols());
  xis.noalias() = etas * cost_.region().axes().transpose();
  xis.rowwise() += cost_.region().centre().transpose();
  allowed.assign(static_cast<size_t>(etas.rows()), 1);
  // What is not finite is outside of every interval, whose ends may be infinite.
  constexpr double kLargest = std::numeric_limits<double>::max();
  const auto allow = [kLargest](const double* values, double lower, double upper) {
    const double from = std::max(lower, -kLargest), to = std::min(upper, kLargest);
    for (size_t i = 0; i < allowed.size(); ++i) {
      allowed[i] &= static_cast<int64_t>(values[i] >= from) & static_cast<int64_t>(values[i] <= to);
    }
  };
  for (Eigen::Index j = 0; j < etas.cols(); ++j) {
    allow(etas.col(j).data(), lower_[j], upper_[j]);
    allow(xis.col(j).data(), cost_.prior().lower()[j], cost_.prior().upper()[j]);
  }
  return allowed;
}

void DifferentialEvolution::Sweep(double beta, Eigen::Index first, Eigen::Index count,
                                  Particles& particles) {
  const Eigen::Index half = count / 2;
  MoveHalf(beta, {first, half, first + half, count - half}, particles);
  MoveHalf(beta, {first + half, count - half, first, half}, particles);
}

void DifferentialEvolution::MoveHalf(double beta, const Halves& halves, Particles& particles) {
  const auto kinds = static_cast<Eigen::Index>(straight_.size());
  const Eigen::Index kind = DrawKind();
  if (kind < kinds) {
    ProposeIn(straight_[static_cast<size_t>(kind)], halves, particles.etas);
  } else {
    Propose(halves, particles.etas);
  }
  Evaluate(proposal_, proposal_costs_);
  for (Eigen::Index i = 0; i < halves.count; ++i) {
    double& cost = particles.costs[halves.first + i];
    const double change = beta * (proposal_costs_[i] - cost) - volume_changes_[i];
    if (change <= 0 || std::log(Uniform()) < -change) {
      particles.etas.row(halves.first + i) = proposal_.row(i);
      cost = proposal_costs_[i];
    }
  }
}

Eigen::Index DifferentialEvolution::DrawKind() {
  const auto kinds = static_cast<Eigen::Index>(straight_.size());
  if (kinds == 0) return 0;
  const Eigen::Index draw = Draw(2 * kinds);
  // Of 0 … 3, both 0 and 1 are then moves along sums.
  const bool by_choice = kinds == 2 && straight_.back().by_choice_alone();
  return by_choice ? std::max<Eigen::Index>(draw - 1, 0) : draw;
}

void DifferentialEvolution::Propose(const Halves& halves, const Matrix& etas) {
  const Eigen::Index n = etas.cols();
  proposal_.resize(halves.count, n);
  volume_changes_.setZero(halves.count);
  for (Eigen::Index i = 0; i < halves.count; ++i) {
    const double gamma = Factor(n);
    const Eigen::Index j = halves.other + Draw(halves.other_count);
    const Eigen::Index k = halves.other + Draw(halves.other_count);
    for (Eigen::Index d = 0; d < n; ++d) {
      proposal_(i, d) = etas(halves.first + i, d) + gamma * (etas(j, d) - etas(k, d)) +
                        kJitter * (upper_[d] - lower_[d]) * normal_(generator_);
    }
  }
}

void DifferentialEvolution::ProposeIn(StraightCoordinates& coordinates, const Halves& halves,
                                      const Matrix& etas) {
  const auto others = etas.middleRows(halves.other, halves.other_count);
  if (coordinates.has_choice()) coordinates.Choose(others, Uniform() < kBothSigns);
  coordinates.FromLocal(etas.middleRows(halves.first, halves.count), us_, &signs_, &volumes_);
  coordinates.FromLocal(others, other_us_, nullptr, nullptr);
  moved_us_.resize(halves.count, etas.cols());
  for (Eigen::Index i = 0; i < halves.count; ++i) {
    const double gamma = Factor(etas.cols());
    const Eigen::Index j = Draw(halves.other_count);
    const Eigen::Index k = Draw(halves.other_count);
    moved_us_.row(i) = us_.row(i) + gamma * (other_us_.row(j) - other_us_.row(k));
  }
  coordinates.ToLocal(moved_us_, signs_, proposal_, moved_volumes_);
  volume_changes_ = moved_volumes_ - volumes_;
}

double DifferentialEvolution::Factor(Eigen::Index dimension) {
  if (Uniform() < kJumpProbability) return 1;
  const double scale = 2.38 / std::sqrt(2.0 * static_cast<double>(dimension));
  return scale * std::exp(kStepSpread * normal_(generator_));
}

Eigen::Index DifferentialEvolution::Draw(Eigen::Index count) {
  return std::min(static_cast<Eigen::Index>(Uniform() * static_cast<double>(count)), count - 1);
}

}  // namespace polyest::internal
