#include "core/estimator/posterior/marginal_description.h"

#include <absl/strings/str_cat.h>

#include "core/bayes/identifiability.h"
#include "core/bayes/parameter_covariance.h"
#include "core/bayes/weighted_samples.h"
#include "core/common/infeasible.h"

namespace polyest::internal {
namespace {

void DescribeByPrior(const Prior& prior, int i, ParameterEstimate& parameter) {
  const UncertainParameter& marginal = prior.parameters()[static_cast<size_t>(i)];
  const Germ germ(marginal.germ);
  parameter.mean = parameter.prior_mean;
  parameter.posterior_std_dev = parameter.prior_std_dev;
  parameter.lower95 = marginal.ToParameter(germ.Quantile(0.025));
  parameter.upper95 = marginal.ToParameter(germ.Quantile(0.975));
  parameter.verdict = Verdict::kNotIdentified;
}

}  // namespace

void DescribeMarginal(const PosteriorDraws& posterior, const Prior& prior, int i,
                      ParameterEstimate& parameter) {
  const Vector theta = posterior.Parameter(prior, i);
  const WeightedQuantiles quantile(theta, posterior.weights);
  parameter.mean = WeightedMean(theta, posterior.weights);
  parameter.posterior_std_dev = WeightedStandardDeviation(theta, posterior.weights);
  parameter.lower95 = quantile(0.025);
  parameter.upper95 = quantile(0.975);
}

void DoubtIfPiecesSpread(ParameterEstimate& parameter) {
  if (parameter.verdict != Verdict::kIdentified) return;
  const double contraction = parameter.posterior_std_dev / parameter.prior_std_dev;
  if (VerdictOfContraction(contraction) == Verdict::kIdentified) return;
  parameter.verdict = Verdict::kWeak;
}

void ReplaceDeviation(int i, double std_dev, Estimate& estimate) {
  ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
  const double ratio = std_dev / parameter.std_dev;
  parameter.std_dev = std_dev;
  parameter.contraction = std_dev / parameter.prior_std_dev;
  estimate.covariance.row(i) *= ratio;
  estimate.covariance.col(i) *= ratio;
}

void GoByPriorIfInaccurate(const Findings& findings, const Prior& prior, Estimate& estimate) {
  const bool inaccurate = findings.power < 1 || findings.shift > kInaccurateShift;
  for (int i = 0; i < prior.dimension(); ++i) {
    ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    const bool unknown = parameter.verdict == Verdict::kNotIdentified ||
                         parameter.posterior_std_dev > parameter.prior_std_dev;
    if (findings.UsesData() && !(unknown && inaccurate)) continue;
    ReplaceDeviation(i, parameter.prior_std_dev, estimate);
    DescribeByPrior(prior, i, parameter);
  }
  if (findings.UsesData()) return;
  const Prior modal = prior.WithModesOfUniform();
  for (int i = 0; i < prior.dimension(); ++i) {
    ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    parameter.map = prior.OfScore(i, modal.germs()[static_cast<size_t>(i)].Mode());
    parameter.robust_std_dev = 0;
  }
  estimate.covariance = PriorCovariance(prior);
  estimate.directions = Directions(Matrix::Zero(prior.dimension(), prior.dimension()), prior);
  estimate.trade_offs.clear();
}

absl::Status CheckFinite(const std::vector<ParameterEstimate>& parameters) {
  for (const ParameterEstimate& p : parameters) {
    const Vector numbers{
        {p.map, p.std_dev, p.mean, p.posterior_std_dev, p.lower95, p.upper95, p.contraction}};
    if (numbers.allFinite()) continue;
    return InfeasibleError(absl::StrCat(
        "the estimate of ", p.name, " is not finite: the posterior has gone far from the prior"));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
