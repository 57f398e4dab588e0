#include <algorithm>

#include "core/common/check.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/problem/assumed_noise.h"
#include "core/estimator/problem/process_noise.h"
#include "core/estimator/studies/experiment_design.h"

namespace polyest::internal {
namespace {

constexpr double kFarBound = 5;  // standard deviations at which a bound no longer matters
// Correlations are reduced by this fraction to remain positive definite in spite of rounding. A
// direction known 10⁻³·⁵ times as well as the parameters becomes that much less certain.
constexpr double kShortened = 1e-7;

absl::StatusOr<UncertainParameter> PriorAfter(const UncertainParameter& before,
                                              const ParameterEstimate& after, double std_dev) {
  const double lower = before.ToParameter(Germ(before.germ).Lower());
  const double upper = before.ToParameter(Germ(before.germ).Upper());
  if (after.mean - kFarBound * std_dev >= lower && after.mean + kFarBound * std_dev <= upper) {
    return UncertainParameter::Normal(before.name, after.mean, std_dev);
  }
  return UncertainParameter::TruncatedNormal(before.name, after.mean, std_dev, lower, upper);
}

void TakeNoise(const Estimate& estimate, std::vector<MeasuredOutput>& measured) {
  for (size_t i = 0; i < measured.size() && i < estimate.channels.size(); ++i) {
    if (!HasNumbers(measured[i].noise) && estimate.channels[i].noise_std_dev > 0) {
      measured[i].noise = {.absolute = estimate.channels[i].noise_std_dev};
    }
  }
}

}  // namespace

absl::StatusOr<ResolvedProblem> WithEstimateAsPrior(const ResolvedProblem& problem,
                                                    const Estimate& estimate) {
  POLYEST_RETURN_IF_ERROR(RefuseFilters(problem.problem(), "a design after an estimate"));
  if (problem.population()) {
    return InvalidField("uncertain", "the estimate of a population cannot be a prior");
  }
  const auto n = static_cast<int>(problem.problem().uncertain.size());
  POLYEST_CHECK(estimate.covariance.rows() >= n);  // the parameters of the first run come first
  const Vector std_dev = estimate.covariance.diagonal().cwiseSqrt();
  // For a posterior in several pieces the covariance is that of the heaviest, so its parameters are
  // used.
  const std::vector<ParameterEstimate>& parameters =
      estimate.components.empty() ? estimate.parameters : estimate.components.front().parameters;
  Problem next = problem.problem();
  std::erase_if(next.correlations, [&](const Correlation& correlation) {
    return std::ranges::any_of(next.uncertain, [&](const UncertainParameter& parameter) {
      return parameter.name == correlation.first && !parameter.per_run;
    });
  });
  for (int i = 0; i < n; ++i) {
    const auto index = static_cast<size_t>(i);
    if (next.uncertain[index].per_run) continue;  // the next run has its own
    POLYEST_ASSIGN_OR_RETURN(next.uncertain[index],
                             PriorAfter(next.uncertain[index], parameters[index], std_dev[i]));
    for (int j = 0; j < i; ++j) {
      if (next.uncertain[static_cast<size_t>(j)].per_run) continue;
      const double correlation = estimate.covariance(i, j) / (std_dev[i] * std_dev[j]);
      if (correlation == 0) continue;
      next.correlations.push_back({next.uncertain[static_cast<size_t>(j)].name,
                                   next.uncertain[index].name, (1 - kShortened) * correlation});
    }
  }
  TakeNoise(estimate, next.measured);
  return ResolvedProblem::Make(std::move(next));
}

}  // namespace polyest::internal
