#include "core/estimator/posterior/posterior_draws.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "core/bayes/importance.h"
#include "core/bayes/markov_chains.h"
#include "core/bayes/posterior.h"
#include "core/chaos/collocation_points.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/cover_draws.h"

namespace polyest::internal {
namespace {

constexpr int kParticles = 2000;
constexpr int kSweeps = 6;        // after each tempering step
constexpr int kFinalSweeps = 20;  // before the chains start
constexpr uint64_t kSeed = 20'071'121;
constexpr int kStarts = 6;
constexpr int kCover = 4096;
// Number of points of the cover, and of the guesses, from which starts are taken.
constexpr Eigen::Index kBest = 256;
// Another minimum, or a distant point, matters when its cost exceeds the least one by less than the
// mean excess of a draw, n/2, plus this: e^−8 ≈ 3·10⁻⁴.
constexpr double kNegligibleCost = 8;
constexpr double kReach = 4;  // reach of the Gaussian's points beyond √n, in standard deviations
constexpr double kMaxDecrement = 1e-3;
constexpr double kOnBound = 1e-6;  // fraction of the box's width
constexpr double kMinEffective = 0.5;
constexpr double kHeaviest = 0.01;
// A cover of the box has so many points for each of importance sampling's. Their effective number
// must be this fraction of it: a cover of low discrepancy knows means far better than as many
// random draws.
constexpr int kCoverPerPoint = 2;
constexpr double kMinEffectiveCover = 0.15;

class Drawing {
 public:
  Drawing(const Cost& cost, const ExpansionDesign& design, const Matrix& guesses,
          const PosteriorEffort& effort, const Stop& stop)
      : cost_(cost),
        design_(design),
        guesses_(design.region.ManyToLocal(guesses)),
        effort_(effort),
        stop_(stop),
        search_(SearchOf(cost, design)) {
    SamplingBox(design, lower_, upper_);
    // z = F ξ,  ξ = centre + axes η
    const Matrix& axes = design.region.axes();
    to_scores_ = cost.prior().correlated() ? Matrix(cost.prior().factor() * axes) : axes;
  }

  absl::StatusOr<PosteriorDraws> Run() {
    Look();
    POLYEST_RETURN_IF_ERROR(stop_.Check());
    if (!DrawByImportance() && !DrawByCover()) POLYEST_RETURN_IF_ERROR(DrawByChains());
    return std::move(draws_);
  }

 private:
  // Computes the costs of the cover and the guesses, and the minima found from the best of them.
  void Look() {
    const Matrix cover = lower_.transpose().replicate(kCover, 1) +
                         UnitCubePoints(PointSet::kHalton, cost_.dimension(), kCover) *
                             (upper_ - lower_).asDiagonal();
    known_.etas.resize(kCover + guesses_.rows(), cost_.dimension());
    known_.etas << cover, guesses_;
    const DifferentialEvolution box(cost_, lower_, upper_, kSeed);
    box.Evaluate(known_.etas, known_.costs);
    Matrix starts(0, cost_.dimension());
    AddStarts(0, kCover, starts);
    AddStarts(kCover, guesses_.rows(), starts);
    if (starts.rows() == 0) return;
    draws_.minima = FindMinima(search_, starts, MinimizerOptions(), stop_);
  }

  // Adds starts spread over the best of the known points [first, first + count).
  void AddStarts(Eigen::Index first, Eigen::Index count, Matrix& starts) const {
    std::vector<Eigen::Index> order;
    for (Eigen::Index i = first; i < first + count; ++i) {
      if (std::isfinite(known_.costs[i])) order.push_back(i);
    }
    if (order.empty()) return;
    const auto better = [&](Eigen::Index a, Eigen::Index b) {
      return known_.costs[a] < known_.costs[b];
    };
    const auto best = std::min(order.size(), static_cast<size_t>(kBest));
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(best), order.end(),
                      better);
    order.resize(best);
    const Matrix points = known_.etas(order, Eigen::all);
    const Vector costs = known_.costs(order);
    const Eigen::Index before = starts.rows();
    starts.conservativeResize(before + kStarts, starts.cols());
    starts.bottomRows(kStarts) = SpreadStarts(points, costs, kStarts);
  }

  bool DrawByImportance() {
    const std::optional<Matrix> factor = GaussianFactor();
    if (!factor) return false;
    WeightedDraws drawn = ImportanceSample(cost_, lower_, upper_, draws_.minima.front().point,
                                           *factor, effort_.importance_points);
    if (drawn.effective_size < kMinEffective * effort_.importance_points ||
        drawn.weights.maxCoeff() > kHeaviest) {
      return false;
    }
    TakeWeighted(std::move(drawn));
    return true;
  }

  bool DrawByCover() {
    if (draws_.minima.empty()) return false;
    const int points = kCoverPerPoint * effort_.importance_points;
    std::optional<WeightedDraws> drawn =
        DrawFromCover(cost_, design_, points, kMinEffectiveCover * effort_.importance_points);
    if (!drawn) return false;
    TakeWeighted(*std::move(drawn));
    return true;
  }

  void TakeWeighted(WeightedDraws drawn) {
    draws_.method = PosteriorMethod::kImportanceSampling;
    draws_.scores = ToScores(drawn.etas);
    draws_.weights = std::move(drawn.weights);
    draws_.effective_size = Vector::Constant(cost_.dimension(), drawn.effective_size);
  }

  // Returns L of H = L Lᵀ if the curvature's Gaussian may approximate the posterior, else nothing.
  std::optional<Matrix> GaussianFactor() const {
    const std::vector<Minimum>& minima = draws_.minima;
    if (minima.empty()) return std::nullopt;
    const double most = minima.front().value + 0.5 * cost_.dimension() + kNegligibleCost;
    if (minima.size() > 1 && minima[1].value < most) return std::nullopt;
    const Vector& eta = minima.front().point;
    if (OnBound(eta)) return std::nullopt;
    Vector gradient(eta.size());
    cost_.EvaluateWithGradient(eta, gradient);
    const Matrix hessian = cost_.Hessian(eta);
    if (!hessian.allFinite() || !gradient.allFinite()) return std::nullopt;
    const CholeskyFactor cholesky(hessian);
    if (!cholesky.positive_definite()) return std::nullopt;
    const Matrix factor = cholesky.Lower();
    // gᵀH⁻¹g/2 = ‖L⁻¹g‖²/2
    if (!(0.5 * cholesky.SolveLower(gradient).squaredNorm() < kMaxDecrement)) {
      return std::nullopt;
    }
    const double reach = std::sqrt(cost_.dimension()) + kReach;
    for (Eigen::Index i = 0; i < known_.costs.size(); ++i) {
      if (!(known_.costs[i] < most)) continue;
      // r = ‖Lᵀ(η − η̂)‖
      const double radius = (factor.transpose() * (known_.etas.row(i).transpose() - eta)).norm();
      if (!(radius < reach)) return std::nullopt;
    }
    return factor;
  }

  bool OnBound(const Vector& eta) const {
    const Vector room = kOnBound * (search_.upper - search_.lower);
    if (((eta - search_.lower).array() < room.array()).any()) return true;
    if (((search_.upper - eta).array() < room.array()).any()) return true;
    for (Eigen::Index i = 0; i < search_.bound.size(); ++i) {
      const auto row = search_.constraint.row(i);
      if (search_.bound[i] - row.dot(eta) < row.cwiseAbs().dot(room)) return true;
    }
    return false;
  }

  absl::Status DrawByChains() {
    SamplerOptions options;
    options.particles = kParticles;
    options.seed = kSeed;
    options.sweeps = kSweeps;
    options.final_sweeps = kFinalSweeps;
    POLYEST_ASSIGN_OR_RETURN(const Particles particles,
                             SamplePosterior(cost_, lower_, upper_, guesses_, options, stop_));
    ChainOptions chain_options;
    chain_options.effective_size = effort_.chain_effective_size;
    chain_options.max_sweeps = effort_.max_sweeps;
    chain_options.seed = kSeed + 1;
    POLYEST_ASSIGN_OR_RETURN(Chains chains, RunChains(cost_, lower_, upper_, particles, to_scores_,
                                                      chain_options, stop_));
    FindMinimaFrom(particles);
    POLYEST_RETURN_IF_ERROR(stop_.Check());
    draws_.method = PosteriorMethod::kMarkovChains;
    draws_.scores = ToScores(chains.etas);
    const Eigen::Index count = chains.etas.rows();
    draws_.weights = Vector::Constant(count, 1 / static_cast<double>(count));
    draws_.effective_size = std::move(chains.effective_size);
    draws_.r_hat = std::move(chains.r_hat);
    return absl::OkStatus();
  }

  // Searches the minima again, from the particles of the posterior and from the minima known so
  // far.
  void FindMinimaFrom(const Particles& particles) {
    Matrix starts = SpreadStarts(particles.etas, particles.costs, kStarts);
    for (const Minimum& minimum : draws_.minima) {
      starts.conservativeResize(starts.rows() + 1, starts.cols());
      starts.bottomRows(1) = minimum.point.transpose();
    }
    draws_.minima = FindMinima(search_, starts, MinimizerOptions(), stop_);
  }

  Matrix ToScores(const Matrix& etas) const {
    const Matrix xis = design_.region.ManyToGerm(etas);
    return cost_.prior().correlated() ? Matrix(xis * cost_.prior().factor().transpose()) : xis;
  }

  const Cost& cost_;
  const ExpansionDesign& design_;
  const Matrix guesses_;  // local
  const PosteriorEffort& effort_;
  const Stop& stop_;
  const MinimizationProblem search_;
  Vector lower_, upper_;
  Matrix to_scores_;
  Particles known_;  // the cover, then the guesses
  PosteriorDraws draws_;
};

}  // namespace

Vector PosteriorDraws::Parameter(const Prior& prior, int i) const {
  return scores.col(i).unaryExpr([&](double z) { return prior.OfScore(i, z); });
}

Matrix PosteriorDraws::Germs(const Prior& prior) const {
  if (!prior.correlated()) return scores;
  Matrix xis(scores.rows(), scores.cols());
  for (Eigen::Index i = 0; i < xis.rows(); ++i) {
    xis.row(i) = prior.OfScores(scores.row(i).transpose()).transpose();
  }
  return xis;
}

absl::StatusOr<PosteriorDraws> DrawPosterior(const Cost& cost, const ExpansionDesign& design,
                                             const Matrix& guesses, const PosteriorEffort& effort,
                                             const Stop& stop) {
  return Drawing(cost, design, guesses, effort, stop).Run();
}

}  // namespace polyest::internal
