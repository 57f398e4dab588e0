// What a mixture component does when a run begins that its expansion has no room for: all earlier
// runs lose their own parameters (problem/ended_runs.h), and the expansion goes on over the shared
// ones and those of the new run.
//
// From then on each run is eliminated at its end, about the region of the shared germs that the
// ended runs have. It is valid near there only. When the posterior has contracted to less than 0.7
// standard deviations in any direction, or has moved by more than one of them, or the noise's scale
// has changed by a quarter, or its correlation, all ended runs are eliminated again about the
// present posterior: at the end of a run, and after a revision of the noise, because another scale
// is learned from what the ended runs say with the present one. As standard deviations fall with
// 1/√R, this happens about whenever the number R of runs has doubled, and all eliminations together
// take about 1 + ½ + ¼ + … = 2 times as long as one of each run. All of it is a function of the
// rows alone.

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "core/bayes/cost_minima.h"
#include "core/common/infeasible.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/expansion/germ_summary.h"
#include "core/estimator/expansion/new_runs.h"
#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/mixture_component.h"

namespace polyest::internal {
namespace {

constexpr double kContraction = 0.7;   // of a standard deviation
constexpr double kMaxMoved = 1;        // standard deviations
constexpr double kMaxRescaled = 1.25;  // factor of the noise's scale
// The Gaussian at the minimum of the cost stands for the posterior where the gradient leaves no
// more than this to be gained: the minimum is not at a bound.
constexpr double kMaxGain = 0.01;
constexpr int kDrawsToBegin = 500;
constexpr int64_t kScannedRows = 4096;

GermSummary Shared(const ResolvedProblem& problem, const GermSummary& all) {
  const std::vector<int> shared = problem.SharedParameters();
  return {all.mean(shared), all.covariance(shared, shared)};
}

// Whether what is known of the ended runs holds about another posterior of the shared germs.
bool HoldsAbout(const EndedRuns& ended, const GermSummary& shared) {
  const Matrix unit = Inverse(ended.factor);
  const Vector moved = unit * (shared.mean - ended.centre);
  if (moved.norm() > kMaxMoved * std::sqrt(static_cast<double>(moved.size()))) return false;
  const Matrix relative = unit * shared.covariance * unit.transpose();
  return SymmetricEigenvalues(relative).minCoeff() > kContraction * kContraction;
}

bool HoldsWith(const EndedRuns& ended, const LearnedNoise& noise) {
  for (size_t c = 0; c < noise.channels.size(); ++c) {
    const ChannelNoise& present = noise.channels[c];
    const auto channel = static_cast<Eigen::Index>(c);
    const double ratio = present.scale / ended.noise_scale[channel];
    if (ratio > kMaxRescaled || ratio < 1 / kMaxRescaled) return false;
    if (present.time_constant_s != ended.noise_time_constant_s[channel] ||
        present.white_share != ended.noise_white_share[channel]) {
      return false;
    }
  }
  return true;
}

// Returns the runs in the first `rows` rows of the record and where they are.
absl::StatusOr<std::vector<RunRows>> FindRuns(const SampleStore& store, int64_t rows) {
  std::vector<RunRows> runs;
  RowBlock block;
  for (int64_t first = 0; first < rows; first += kScannedRows) {
    const int64_t count = std::min(kScannedRows, rows - first);
    POLYEST_RETURN_IF_ERROR(store.Read(first, count, block));
    for (int64_t k = 0; k < count; ++k) {
      const int run = block.rows[static_cast<size_t>(k)].run;
      if (runs.empty() || runs.back().run != run) runs.push_back({run, first + k, first + k});
      runs.back().end = first + k + 1;
    }
  }
  return runs;
}

}  // namespace

// Returns the Gaussian at the minimum of the cost, if it is one.
std::optional<GermSummary> MixtureComponent::GaussianPosterior(const Stop& stop) const {
  const Cost cost = expansion_->MakeCost(problem_.problem().regularization);
  const ExpansionDesign& design = expansion_->design();
  const Minimum minimum =
      FindMinimaOf(cost, SearchOf(cost, design), design.reference.transpose(), stop).front();
  Vector gradient(minimum.point.size());
  cost.EvaluateWithGradient(minimum.point, gradient);
  const Matrix hessian = cost.Hessian(minimum.point);
  const CholeskyFactor factor(hessian);
  if (!gradient.allFinite() || !hessian.allFinite() || !factor.positive_definite()) {
    return std::nullopt;
  }
  if (factor.SolveLower(gradient).squaredNorm() > kMaxGain) return std::nullopt;
  const Matrix& axes = design.region.axes();
  GermSummary summary{design.region.ToGerm(minimum.point),
                      axes * Inverse(hessian) * axes.transpose()};
  // Where the data say little the curvature may be less than the prior's.
  const Vector prior = problem_.prior().GermStandardDeviation();
  const bool narrow = (summary.covariance.diagonal().cwiseSqrt().array() <= prior.array()).all();
  return narrow ? std::optional(std::move(summary)) : std::nullopt;
}

// Returns particles of the present posterior, germ coordinates. Leaves the component as it is, so
// that a stop has no effect on later results.
absl::StatusOr<Matrix> MixtureComponent::ParticlesNow(const Stop& stop) const {
  SettlementRequest request = RequestSettlement();
  request.may_raise_order = false;
  request.memory = {};  // the particles are drawn anew
  request.allowance = ReplayAllowance();
  POLYEST_ASSIGN_OR_RETURN(Settlement settlement, MakeSettlement(*expansion_, request, stop));
  if (settlement.particles.rows() <= problem_.dimension()) {
    return InfeasibleError("the posterior of a run that has ended was not found");
  }
  return std::move(settlement.particles);
}

// Adds the last run to the ended ones and returns the trajectories × rows that it took.
absl::StatusOr<int64_t> MixtureComponent::EliminateLast(const GermSummary& posterior,
                                                        const Stop& stop, EndedRuns& ended) const {
  const EliminationRequest request{&problem_, store_, threads_, expansion_->noise()};
  const int run = problem_.runs() - 1;
  return EliminateRun(request, {run, ended.rows, taken_},
                      PathIn(problem_, run, posterior, ended.region.centre()), stop, ended);
}

// Eliminates all runs in the first `rows` rows about the particles, and returns the trajectories ×
// rows that it took.
absl::StatusOr<int64_t> MixtureComponent::EliminateAll(const Matrix& particles, int64_t rows,
                                                       const Stop& stop, EndedRuns& ended) const {
  const EliminationRequest request{&problem_, store_, threads_, expansion_->noise()};
  const GermSummary posterior = SummaryOf(particles);
  const Matrix shared = particles(Eigen::all, problem_.SharedParameters());
  ended = WithoutEndedRuns(problem_, RegionOfParticles(shared), Shared(problem_, posterior),
                           expansion_->noise());
  POLYEST_ASSIGN_OR_RETURN(const std::vector<RunRows> runs, FindRuns(*store_, rows));
  const EndedRuns* before = problem_.ended_runs();
  const size_t known = before != nullptr ? before->run.size() : 0;
  int64_t propagated = 0;
  for (size_t i = 0; i < runs.size(); ++i) {
    RunPath path;
    if (i < known) {
      path = before->Path(i);
      path.centre += path.slope * (ended.region.centre() - before->region.centre());
    } else {
      path = PathIn(problem_, runs[i].run, posterior, ended.region.centre());
    }
    POLYEST_ASSIGN_OR_RETURN(const int64_t work, EliminateRun(request, runs[i], path, stop, ended));
    propagated += work;
  }
  return propagated;
}

absl::Status MixtureComponent::BeginAwaitedRun(const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(BeginRunAlone(*awaited_run_, stop));
  awaited_run_.reset();
  particles_for_run_.reset();
  return absl::OkStatus();
}

absl::Status MixtureComponent::BeginRunAlone(int run, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem next, problem_.OfRun(run));
  std::optional<Matrix> particles = particles_for_run_;
  std::optional<GermSummary> posterior;
  if (!particles) {
    posterior = GaussianPosterior(stop);
    POLYEST_RETURN_IF_ERROR(stop.Check());
    if (!posterior) {
      POLYEST_ASSIGN_OR_RETURN(particles, ParticlesNow(stop));
    }
  }
  if (!posterior) posterior = SummaryOf(*particles);
  const EndedRuns* before = problem_.ended_runs();
  const bool holds = before != nullptr && HoldsAbout(*before, Shared(problem_, *posterior)) &&
                     HoldsWith(*before, expansion_->noise());
  auto ended = holds ? std::make_shared<EndedRuns>(*before) : std::make_shared<EndedRuns>();
  int64_t work = 0;
  if (holds) {
    POLYEST_ASSIGN_OR_RETURN(work, EliminateLast(*posterior, stop, *ended));
  } else {
    if (!particles) {
      POLYEST_ASSIGN_OR_RETURN(particles, ParticlesNow(stop));
      posterior = SummaryOf(*particles);
    }
    POLYEST_ASSIGN_OR_RETURN(work, EliminateAll(*particles, taken_, stop, *ended));
  }
  next.set_ended_runs(std::move(ended));
  POLYEST_RETURN_IF_ERROR(GoOnWith(std::move(next), Shared(problem_, *posterior), stop));
  abandoned_rows_ += work;
  if (!holds) {
    ++settlements_;
    ++reexpansions_;
  }
  return absl::OkStatus();
}

// Eliminates the ended runs again if they were eliminated with another noise. A stop changes
// nothing.
absl::Status MixtureComponent::RenewEndedRuns(const Stop& stop) {
  const EndedRuns* before = problem_.ended_runs();
  if (before == nullptr || HoldsWith(*before, expansion_->noise()) || IsReplayWithheld()) {
    return absl::OkStatus();
  }
  POLYEST_ASSIGN_OR_RETURN(Matrix particles, ParticlesNow(stop));
  auto ended = std::make_shared<EndedRuns>();
  POLYEST_ASSIGN_OR_RETURN(const int64_t work, EliminateAll(particles, before->rows, stop, *ended));
  ResolvedProblem renewed = problem_;
  renewed.set_ended_runs(std::move(ended));
  POLYEST_RETURN_IF_ERROR(ReplayAs(std::move(renewed), expansion_->design(),
                                   expansion_->noise().ForNewExpansion(), std::move(particles),
                                   stop));
  abandoned_rows_ += work;
  ++settlements_;
  ++reexpansions_;
  return absl::OkStatus();
}

// Goes on with a problem whose run has no rows yet; `shared` is the posterior of the shared germs.
absl::Status MixtureComponent::GoOnWith(ResolvedProblem next, const GermSummary& shared,
                                        const Stop& stop) {
  const Matrix factor = FactorOf(shared.covariance);
  LearnedNoise noise = expansion_->noise().ForNewExpansion();
  if (noise.posterior.centre.size() > 0) {
    noise.posterior = SummaryAfterEndedRuns(next, shared.mean, factor);
  }
  noise.centre.resize(0);
  ExpansionDesign design =
      DesignAfterEndedRuns(next, shared.mean, factor, expansion_->design().element);
  Matrix draws = DrawsForNewRun(next, shared.mean, factor, kDrawsToBegin).etas;
  POLYEST_RETURN_IF_ERROR(
      ReplayAs(std::move(next), std::move(design), std::move(noise), std::move(draws), stop));
  schedule_.CountAnewFrom(taken_);
  bisected_ = bisected_ && !element().bounds().empty();
  return absl::OkStatus();
}

}  // namespace polyest::internal
