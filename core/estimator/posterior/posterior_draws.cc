#include "core/estimator/posterior/posterior_draws.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/bayes/cost_minima.h"
#include "core/bayes/markov_chains.h"
#include "core/bayes/posterior.h"
#include "core/bayes/weighted_samples.h"
#include "core/common/status.h"
#include "core/estimator/expansion/guarded_importance.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/cover_draws.h"

namespace polyest::internal {
namespace {

constexpr int kParticles = 2000;
// Moves of each particle after a tempering step, and where the cost has several minima in many
// dimensions: on ridges between them the particles take longer to find their shares.
constexpr int kSweeps = 6, kSweepsOfSeveral = 30;
constexpr int kFinalSweeps = 20;  // before the chains start
constexpr uint64_t kSeed = 20'071'121;
constexpr int kStarts = 6;
// Importance sampling's points for each parameter, where there are few parameters. 8,192 points in
// two dimensions give a normal distribution's 2.5 % quantiles to 0.005 standard deviations.
constexpr int kPointsPerParameter = 2'048;
// A cover of the box has so many points for each of importance sampling's. Their effective number
// must be this fraction of it: a cover of low discrepancy knows means far better than as many
// random draws.
constexpr int kCoverPerPoint = 4;
constexpr double kMinEffectiveCover = 0.15;
// Limits for chains, of Vehtari et al.
constexpr double kMaxRHat = 1.01;
constexpr double kMinEffectiveSize = 400;

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
    const bool drawn = DrawByImportance();
    POLYEST_RETURN_IF_ERROR(stop_.Check());
    if (!drawn && !DrawByCover()) POLYEST_RETURN_IF_ERROR(DrawByChains());
    return std::move(draws_);
  }

 private:
  // Returns whether the posterior is nearly Gaussian.
  bool DrawByImportance() {
    GuardedDraws drawn =
        DrawIfNearlyGaussian(cost_, design_, guesses_, effort_.importance_points, stop_);
    draws_.minima = std::move(drawn.minima);
    rough_ = std::move(drawn.rough);
    if (!drawn.draws) return false;
    TakeWeighted(*std::move(drawn.draws));
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

  // Returns particles of the posterior.
  absl::StatusOr<Particles> StartOfChains() {
    if (rough_) return Resampled(*rough_, kParticles, kSeed);
    SamplerOptions options;
    options.particles = kParticles;
    options.seed = kSeed;
    const bool several = draws_.minima.size() > 1 && cost_.dimension() > kFewDimensions;
    options.sweeps = several ? kSweepsOfSeveral : kSweeps;
    options.final_sweeps = kFinalSweeps;
    return SamplePosterior(cost_, lower_, upper_, guesses_, options, stop_);
  }

  absl::Status DrawByChains() {
    POLYEST_ASSIGN_OR_RETURN(const Particles particles, StartOfChains());
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
    draws_.chain = std::move(chains.group);
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
    draws_.minima = FindMinimaOf(cost_, search_, starts, stop_);
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
  std::optional<WeightedDraws> rough_;
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

PosteriorEffort EffortForEstimate(const ResolvedProblem& problem) {
  PosteriorEffort effort;
  const bool unknown_noise =
      std::ranges::any_of(problem.problem().measured, [](const MeasuredOutput& output) {
        return output.noise.unknown || output.noise.correlation == NoiseCorrelation::kUnknown;
      });
  if (unknown_noise) return effort;
  const int points = kPointsPerParameter * problem.dimension();
  effort.importance_points = std::min(effort.importance_points, points);
  return effort;
}

std::string WhyNotMixed(const PosteriorDraws& draws) {
  if (draws.r_hat.size() == 0) return "";
  std::vector<std::string> failed;
  const double r_hat = draws.r_hat.maxCoeff(), effective_size = draws.effective_size.minCoeff();
  if (!(r_hat <= kMaxRHat)) {
    failed.push_back(absl::StrFormat("R̂ is %.3f and should be at most %.2f", r_hat, kMaxRHat));
  }
  if (!(effective_size >= kMinEffectiveSize)) {
    failed.push_back(
        absl::StrFormat("the draws are worth %.0f independent ones and should be worth %d",
                        effective_size, static_cast<int>(kMinEffectiveSize)));
  }
  return absl::StrJoin(failed, ", and ");
}

void Reweigh(const ConstVectorRef& log_factors, PosteriorDraws& draws) {
  const double before = 1 / draws.weights.squaredNorm();
  draws.weights.array() *= (log_factors.array() - log_factors.maxCoeff()).exp();
  draws.weights /= draws.weights.sum();
  draws.effective_size *= std::min(1.0, 1 / draws.weights.squaredNorm() / before);
}

void Widen(const Vector& factors, const Prior& prior, PosteriorDraws& draws) {
  const Vector most = prior.GermStandardDeviation();
  for (int i = 0; i < prior.dimension(); ++i) {
    auto scores = draws.scores.col(i).array();
    const double centre = WeightedMean(draws.scores.col(i), draws.weights);
    const double deviation = std::sqrt(draws.weights.dot((scores - centre).square().matrix()));
    const double widening = std::min(factors[i], most[i] / deviation);
    if (!(widening > 1)) continue;
    scores = (centre + widening * (scores - centre)).max(prior.lower()[i]).min(prior.upper()[i]);
  }
}

absl::StatusOr<PosteriorDraws> DrawPosterior(const Cost& cost, const ExpansionDesign& design,
                                             const Matrix& guesses, const PosteriorEffort& effort,
                                             const Stop& stop) {
  return Drawing(cost, design, guesses, effort, stop).Run();
}

}  // namespace polyest::internal
