#include "core/estimator/posterior/window_assessment.h"

#include <algorithm>
#include <cmath>

#include "core/bayes/identifiability.h"
#include "core/common/linear_algebra.h"
#include "core/estimator/posterior/residual_tests.h"

namespace polyest::internal {
namespace {

constexpr size_t kMaxEstimates = 16;  // windows for which estimates are given

const NoiseModel& NoiseOf(const ResolvedProblem& problem, size_t channel) {
  return problem.problem().measured[channel].noise;
}

// Whether the residuals, for all their correlation, are still smaller than the noise.
bool AreSmall(const ChannelEstimate& channel, double degrees, const NoiseModel& noise) {
  return !noise.unknown && channel.chi_squared * VarianceOfMeans(channel) < degrees;
}

// Returns whether the residuals of any channel are larger than the noise, or correlated.
bool ResidualsContradict(const ResolvedProblem& problem, const RecordSummary& record,
                         const std::vector<ChannelEstimate>& channels,
                         const std::vector<double>& degrees) {
  for (size_t c = 0; c < channels.size(); ++c) {
    const NoiseModel& noise = NoiseOf(problem, c);
    if (!noise.unknown &&
        ExceedsNoise(channels[c], degrees[c], noise.outliers, problem.uses_filters())) {
      return true;
    }
    if (c >= record.channels().size()) continue;
    const bool correlated =
        AreCorrelated(channels[c], record.channels()[c].Runs()) || AreSlowlyCorrelated(channels[c]);
    if (correlated && !AreSmall(channels[c], degrees[c], noise)) return true;
  }
  return false;
}

// Completes the information about parameters of variances. A whitened innovation w = ν/√S changes
// with them by −½ w ∂log S, so that I_w has ¼ Σ (∂log S)², where the variance of their scores is
// ½ Σ (∂log S)².
void CompleteInformation(const ResolvedProblem& problem, std::vector<WindowScore>& windows) {
  std::vector<int> of_variance;
  for (int i = 0; i < problem.dimension(); ++i) {
    if (problem.IsOfVariance(i)) of_variance.push_back(i);
  }
  if (of_variance.empty()) return;
  for (WindowScore& window : windows) {
    const Matrix part = window.information(of_variance, of_variance);
    window.information(of_variance, of_variance) = 2 * part;
  }
}

double LargestDispersion(const ResolvedProblem& problem,
                         const std::vector<ChannelEstimate>& channels,
                         const std::vector<double>& degrees) {
  double largest = 1;
  for (size_t c = 0; c < channels.size(); ++c) {
    largest = std::max(largest, Dispersion(channels[c], degrees[c], !NoiseOf(problem, c).unknown));
  }
  return largest;
}

// Returns the gradient of α² J_apriori in the coordinates of the scores; 0 where it is infinite, at
// some bounds.
Vector PriorGradient(const Prior& prior, const Vector& xi, double regularization) {
  Vector gradient = regularization * prior.Gradient(xi);
  if (!gradient.allFinite()) return Vector::Zero(xi.size());
  if (prior.correlated()) gradient = SolveTransposed(prior.factor(), gradient);
  return gradient.cwiseProduct(prior.GermStandardDeviation());
}

// Returns what the window's samples and the prior alone say: a Gauss–Newton step from the estimate.
WindowEstimate EstimateOfWindow(const WindowScore& window, const Prior& prior, const Vector& xi,
                                const Matrix& precision, const Vector& prior_gradient) {
  WindowEstimate estimate;
  estimate.first_run = window.span.first_run;
  estimate.last_run = window.span.last_run;
  estimate.start_s = window.span.start_s;
  estimate.end_s = window.span.end_s;
  const Matrix total = window.information + precision;
  if (!CholeskyFactor(total).positive_definite()) return estimate;
  const Matrix covariance = Inverse(total);
  const Vector step = -(covariance * (window.score + prior_gradient));
  for (int i = 0; i < prior.dimension(); ++i) {
    const double deviation = std::sqrt(covariance(i, i));
    if (VerdictOfContraction(deviation) != Verdict::kIdentified) continue;
    estimate.parameters.push_back(ChangedParameter(prior, xi, i, step[i], deviation));
  }
  return estimate;
}

std::vector<WindowEstimate> EstimatesByWindow(std::vector<WindowScore> windows, const Prior& prior,
                                              const Vector& xi, const Matrix& precision,
                                              const Vector& prior_gradient) {
  while (windows.size() > kMaxEstimates) windows = MergePairs(windows);
  std::vector<WindowEstimate> estimates;
  for (const WindowScore& window : windows) {
    estimates.push_back(EstimateOfWindow(window, prior, xi, precision, prior_gradient));
  }
  return estimates;
}

void Widen(double dispersion, WindowAssessment& assessment) {
  const Vector& ratio = assessment.robust.ratio;
  for (Eigen::Index i = 0; i < assessment.widening.size(); ++i) {
    assessment.widening[i] = std::max(1.0, ratio.size() > 0 ? ratio[i] : std::sqrt(dispersion));
    if (assessment.Disagree() && ratio[i] > kDisagreement) {
      assessment.doubtful[static_cast<size_t>(i)] = true;
    }
  }
  if (assessment.inconsistency) {
    assessment.doubtful[static_cast<size_t>(assessment.inconsistency->parameter)] = true;
  }
}

}  // namespace

WindowParameter ChangedParameter(const Prior& prior, const Vector& xi, int i, double change,
                                 double std_dev) {
  const double unit = prior.GermStandardDeviation()[i];
  const double lower = prior.lower()[i], upper = prior.upper()[i];
  const double z = std::clamp(prior.ToScores(xi)[i] + change * unit, lower, upper);
  // The standard deviation by the slope within the bounds.
  const double above = std::min(upper, z + std_dev * unit);
  const double below = std::max(lower, z - std_dev * unit);
  if (!(above > below)) return {i, prior.OfScore(i, z), 0};
  const double slope = (prior.OfScore(i, above) - prior.OfScore(i, below)) / (above - below);
  return {i, prior.OfScore(i, z), slope * std_dev * unit};
}

WindowAssessment AssessWindows(const RegionalExpansion& expansion, const ResolvedProblem& problem,
                               const RecordSummary& record,
                               const std::vector<ChannelEstimate>& channels,
                               const std::vector<double>& degrees, const Vector& eta,
                               double regularization) {
  const Prior& prior = problem.prior();
  WindowAssessment assessment;
  assessment.widening = Vector::Ones(prior.dimension());
  assessment.doubtful.assign(static_cast<size_t>(prior.dimension()), false);
  const Vector xi = expansion.design().region.ToGerm(eta);
  const bool has_ended = problem.ended_runs() != nullptr;
  std::vector<WindowScore> windows =
      has_ended ? ScoresByEndedRuns(problem, xi) : ScoresByWindow(expansion, prior, eta);
  if (windows.empty()) {
    // Runs that share a population have no windows, and the residuals alone tell of a wrong model.
    assessment.contradicted = has_ended && ResidualsContradict(problem, record, channels, degrees);
    if (assessment.contradicted) Widen(LargestDispersion(problem, channels, degrees), assessment);
    return assessment;
  }
  CompleteInformation(problem, windows);
  const Matrix precision = PriorPrecision(prior);
  const Vector prior_gradient = PriorGradient(prior, xi, regularization);
  const double dispersion = LargestDispersion(problem, channels, degrees);
  assessment.robust = RobustCovarianceOf(windows, precision);
  assessment.inconsistency = FindInconsistency(windows, precision, prior_gradient, dispersion);
  const bool windows_contradict = assessment.Disagree() || assessment.inconsistency.has_value();
  assessment.contradicted =
      windows_contradict || ResidualsContradict(problem, record, channels, degrees);
  if (assessment.contradicted) Widen(dispersion, assessment);
  if (windows_contradict) {
    assessment.estimates = EstimatesByWindow(windows, prior, xi, precision, prior_gradient);
  }
  return assessment;
}

}  // namespace polyest::internal
