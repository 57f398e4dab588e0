#include "core/estimator/expansion/population_of_runs.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/common/linear_algebra.h"
#include "core/estimator/expansion/expansion_design.h"

namespace polyest::internal {
namespace {

constexpr int kScoreNodes = 51;  // over the region of the run's score, ± 4 standard deviations

// Returns −log ∫ e^{−J} at places of the score, u half widths of the region from its centre, over
// the run's other own parameters.
Vector CostsAlong(const Cost& cost, const Vector& origin, const Vector& across,
                  const ConditionalMinimum& minimum, const Vector& places) {
  const Eigen::Index n = origin.size(), own = across.size();
  const Matrix basis = OrthonormalBasisFrom(across);
  const auto at = [&](double u) {
    Vector eta = origin;
    eta.tail(own) += u * across.normalized();
    return eta;
  };
  Vector costs(places.size());
  if (own == 1) {
    Matrix etas(places.size(), n);
    for (Eigen::Index i = 0; i < places.size(); ++i) etas.row(i) = at(places[i]).transpose();
    cost.EvaluateMany(etas, costs);
    return costs;
  }
  Matrix directions = Matrix::Zero(n, own - 1);
  directions.bottomRows(own) = basis.rightCols(own - 1);
  const RunMarginal marginal(cost, directions);
  const auto follow = [&](Eigen::Index first, Eigen::Index end, Eigen::Index step) {
    Vector start = basis.rightCols(own - 1).transpose() * minimum.own;
    for (Eigen::Index i = first; i != end; i += step) {
      const Vector place = at(places[i]);
      const ConditionalMinimum found = marginal.Minimize(place, start);
      costs[i] = marginal.NegativeLogIntegral(place, found);
      if (found.own.allFinite()) start = found.own;
    }
  };
  // Outwards from the minimum.
  const double u = minimum.own.dot(across.normalized());
  const Eigen::Index middle = std::ranges::lower_bound(places, u) - places.begin();
  follow(middle, places.size(), 1);
  follow(middle - 1, -1, -1);
  return costs;
}

// Returns the likelihood of the run's score at another place than the centre.
ScoreLikelihood LikelihoodAt(const ResolvedProblem& problem, const Cost& cost,
                             const Vector& eta_shared) {
  const Eigen::Index shared = eta_shared.size(), n = cost.dimension();
  Vector origin = Vector::Zero(n);
  origin.head(shared) = eta_shared;
  const Region& region = cost.region();
  const Vector start = region.ToLocal(NearestInside(problem.prior(), region.ToGerm(origin)));
  const RunMarginal marginal(cost, Matrix::Identity(n, n).rightCols(n - shared));
  return ScoreLikelihoodOf(problem, cost, eta_shared,
                           marginal.Minimize(origin, start.tail(n - shared)));
}

// Where the parts of a population are among the shared germs.
struct PartsAmongShared {
  Eigen::Index mean, spread;
};

PartsAmongShared FindParts(const ResolvedProblem& problem) {
  const std::vector<int> shared = problem.SharedParameters();
  const ResolvedProblem::Population population = *problem.population();
  return {std::ranges::find(shared, population.mean) - shared.begin(),
          std::ranges::find(shared, population.spread) - shared.begin()};
}

}  // namespace

std::shared_ptr<const PopulationCost> PopulationCostOf(const ResolvedProblem& problem) {
  const ResolvedProblem::Population population = *problem.population();
  const EndedRuns* ended = problem.ended_runs();
  const auto count = static_cast<Eigen::Index>(ended != nullptr ? ended->run.size() : 0);
  const Eigen::Index runs = count + problem.runs() - problem.first_run();
  Vector base = Vector::Zero(runs), variance = Vector::Zero(runs);
  Matrix slope = Matrix::Zero(runs, problem.dimension());
  const std::vector<int> shared = problem.SharedParameters();
  for (Eigen::Index r = 0; r < count; ++r) {
    const RunPath path = ended->Path(static_cast<size_t>(r));
    const int own = population.own;
    slope(r, shared) = path.slope.row(own);
    base[r] = path.centre[own] - path.slope.row(own).dot(ended->region.centre());
    variance[r] = std::min(1.0, path.spread.row(own).squaredNorm());
  }
  for (Eigen::Index r = count; r < runs; ++r) {
    const int run = problem.first_run() + static_cast<int>(r - count);
    slope(r, problem.OwnParameters(run)[static_cast<size_t>(population.own)]) = 1;
  }
  return std::make_shared<const PopulationCost>(
      population.mean, population.spread, std::move(base), std::move(slope), std::move(variance),
      ended != nullptr ? ended->shapes : std::vector<ScoreMixture>());
}

ScoreLikelihood ScoreLikelihoodOf(const ResolvedProblem& problem, const Cost& cost,
                                  const Vector& eta_shared, const ConditionalMinimum& minimum) {
  const std::vector<int> owns = problem.OwnParameters(problem.runs() - 1);
  const auto germ = static_cast<Eigen::Index>(owns[static_cast<size_t>(problem.population()->own)]);
  const Eigen::Index own = std::ssize(owns);
  Vector origin = Vector::Zero(eta_shared.size() + own);
  origin.head(eta_shared.size()) = eta_shared;
  // g = base + |across| u
  const Vector across = cost.region().axes().row(germ).tail(own).transpose();
  const double base = cost.region().ToGerm(origin)[germ], scale = across.norm();
  const Vector places = Vector::LinSpaced(kScoreNodes, -1, 1);
  Vector log_likelihood = -CostsAlong(cost, origin, across, minimum, places);
  // The cost has the score's standard normal prior.
  log_likelihood.array() += 0.5 * (base + scale * places.array()).square();
  return {base - scale, scale * (places[1] - places[0]), std::move(log_likelihood)};
}

void SetScore(const ResolvedProblem& problem, const RunScore& score, RunPath& path) {
  const int i = problem.population()->own;
  const Vector with = path.spread * path.spread.row(i).transpose();
  path.centre += (score.mean - path.centre[i]) / with[i] * with;
  const double more = (score.variance / with[i] - 1) / with[i];
  const Matrix covariance = path.spread * path.spread.transpose() + more * with * with.transpose();
  const CholeskyFactor factor(covariance);
  if (factor.positive_definite()) path.spread = factor.Lower();
}

void TellPopulation(const ResolvedProblem& problem, const Cost& cost, const RunPath& path,
                    const ScoreLikelihood& score, EndedRuns& ended) {
  const auto [mean, spread] = FindParts(problem);
  const int own = problem.population()->own;
  const ScoreMixture shape = score.Mixture();
  const double variance = path.spread.row(own).squaredNorm();
  const auto left_out = [&, mean = mean, spread = spread](const Vector& xi) {
    const ScoreLikelihood likelihood = LikelihoodAt(problem, cost, ended.region.ToLocal(xi));
    const double centre = path.centre[own] + path.slope.row(own).dot(xi - ended.region.centre());
    const PopulationCost told(0, 1, Vector::Constant(1, centre), Matrix::Zero(1, 2),
                              Vector::Constant(1, std::min(1.0, variance)), {shape});
    return likelihood.NegativeLogEvidence(PopulationOfGerms(xi[mean], xi[spread])) -
           likelihood.NegativeLogEvidence({0, 1}) - told.Evaluate(Vector{{xi[mean], xi[spread]}});
  };
  Vector slope(ended.factor.cols());
  for (Eigen::Index j = 0; j < slope.size(); ++j) {
    slope[j] = 0.5 * (left_out(ended.centre + ended.factor.col(j)) -
                      left_out(ended.centre - ended.factor.col(j)));
  }
  const Vector left = SolveTransposed(ended.factor, slope);
  if (left.allFinite()) {
    ended.left_out += left;
  } else {
    ended.unresolved += 1;
  }
  ended.shapes.push_back(shape);
}

}  // namespace polyest::internal
