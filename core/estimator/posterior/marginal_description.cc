#include "core/estimator/posterior/marginal_description.h"

#include <absl/strings/str_cat.h>

#include "core/bayes/weighted_samples.h"
#include "core/common/infeasible.h"

namespace polyest::internal {

void DescribeMarginal(const PosteriorDraws& posterior, const Prior& prior, int i,
                      ParameterEstimate& parameter) {
  const Vector theta = posterior.Parameter(prior, i);
  const WeightedQuantiles quantile(theta, posterior.weights);
  parameter.mean = WeightedMean(theta, posterior.weights);
  parameter.posterior_std_dev = WeightedStandardDeviation(theta, posterior.weights);
  parameter.lower95 = quantile(0.025);
  parameter.upper95 = quantile(0.975);
}

void GoByPriorIfInaccurate(const Findings& findings, const Prior& prior, int i,
                           ParameterEstimate& parameter) {
  const bool unknown = parameter.verdict == Verdict::kNotIdentified ||
                       parameter.posterior_std_dev > parameter.prior_std_dev;
  const bool inaccurate = findings.power < 1 || findings.shift > kInaccurateShift;
  if (findings.UsesData() && !(unknown && inaccurate)) return;
  const UncertainParameter& marginal = prior.parameters()[static_cast<size_t>(i)];
  const Germ germ(marginal.germ);
  if (!findings.UsesData()) {
    const Germ modal = prior.WithModesOfUniform().germs()[static_cast<size_t>(i)];
    parameter.map = prior.OfScore(i, modal.Mode());
  }
  parameter.mean = parameter.prior_mean;
  parameter.posterior_std_dev = parameter.std_dev = parameter.prior_std_dev;
  parameter.lower95 = marginal.ToParameter(germ.Quantile(0.025));
  parameter.upper95 = marginal.ToParameter(germ.Quantile(0.975));
  parameter.contraction = 1;
  parameter.verdict = Verdict::kNotIdentified;
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
