#include "core/estimator/expansion/ended_runs_renewal.h"

#include <cmath>
#include <utility>
#include <vector>

#include "core/bayes/cost_minima.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/expansion/new_runs.h"
#include "core/estimator/expansion/search_domain.h"

namespace polyest::internal {
namespace {

constexpr double kContraction = 0.7;   // of a standard deviation
constexpr double kMaxMoved = 1;        // standard deviations
constexpr double kMaxRescaled = 1.25;  // factor of the noise's scale
// The Gaussian at the minimum of the cost stands for the posterior where the gradient leaves no
// more than this to be gained: the minimum is not at a bound.
constexpr double kMaxGain = 0.01;
constexpr int64_t kScannedRows = 4096;

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

GermSummary SharedPart(const ResolvedProblem& problem, const GermSummary& posterior) {
  const std::vector<int> shared = problem.SharedParameters();
  return {posterior.mean(shared), posterior.covariance(shared, shared)};
}

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

std::optional<GermSummary> GaussianPosterior(const ResolvedProblem& problem,
                                             const RegionalExpansion& expansion, const Stop& stop) {
  const Cost cost = expansion.MakeCost(problem.problem().regularization);
  const ExpansionDesign& design = expansion.design();
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
  const Vector prior = problem.prior().GermStandardDeviation();
  const bool narrow = (summary.covariance.diagonal().cwiseSqrt().array() <= prior.array()).all();
  return narrow ? std::optional(std::move(summary)) : std::nullopt;
}

absl::StatusOr<int64_t> EliminateLast(const EliminationRequest& request,
                                      const GermSummary& posterior, int64_t rows, const Stop& stop,
                                      EndedRuns& ended) {
  const ResolvedProblem& problem = *request.problem;
  const int run = problem.runs() - 1;
  return EliminateRun(request, {run, ended.rows, rows},
                      PathIn(problem, run, posterior, ended.region.centre()), stop, ended);
}

absl::StatusOr<int64_t> EliminateAll(const EliminationRequest& request, const Matrix& particles,
                                     int64_t rows, const Stop& stop, EndedRuns& ended) {
  const ResolvedProblem& problem = *request.problem;
  const GermSummary posterior = SummaryOf(particles);
  const Matrix shared = particles(Eigen::all, problem.SharedParameters());
  ended = WithoutEndedRuns(problem, RegionOfParticles(shared), SharedPart(problem, posterior),
                           request.noise);
  POLYEST_ASSIGN_OR_RETURN(const std::vector<RunRows> runs, FindRuns(*request.store, rows));
  const EndedRuns* before = problem.ended_runs();
  const size_t known = before != nullptr ? before->run.size() : 0;
  int64_t propagated = 0;
  for (size_t i = 0; i < runs.size(); ++i) {
    RunPath path;
    if (i < known) {
      path = before->Path(i);
      path.centre += path.slope * (ended.region.centre() - before->region.centre());
    } else {
      path = PathIn(problem, runs[i].run, posterior, ended.region.centre());
    }
    POLYEST_ASSIGN_OR_RETURN(const int64_t work, EliminateRun(request, runs[i], path, stop, ended));
    propagated += work;
  }
  return propagated;
}

}  // namespace polyest::internal
