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

// Whether the estimate of the parameter is what its prior says.
bool IsPrior(const ParameterEstimate& parameter) {
  return parameter.mean == parameter.prior_mean && parameter.std_dev == parameter.prior_std_dev;
}

absl::StatusOr<UncertainParameter> PriorAfter(const UncertainParameter& before,
                                              const ParameterEstimate& after, double std_dev) {
  if (IsPrior(after)) return before;
  const double lower = before.ToParameter(Germ(before.germ).Lower());
  const double upper = before.ToParameter(Germ(before.germ).Upper());
  if (after.mean - kFarBound * std_dev >= lower && after.mean + kFarBound * std_dev <= upper) {
    return UncertainParameter::Normal(before.name, after.mean, std_dev);
  }
  return UncertainParameter::TruncatedNormal(before.name, after.mean, std_dev, lower, upper);
}

// Replaces the priors, except those of parameters of runs: the next run has its own.
absl::Status TakeParameters(const std::vector<ParameterEstimate>& parameters,
                            const Matrix& covariance, Problem& next) {
  const Vector std_dev = covariance.diagonal().cwiseSqrt();
  std::erase_if(next.correlations, [&](const Correlation& correlation) {
    return std::ranges::any_of(next.uncertain, [&](const UncertainParameter& parameter) {
      return parameter.name == correlation.first && !parameter.per_run;
    });
  });
  for (size_t i = 0; i < next.uncertain.size(); ++i) {
    if (next.uncertain[i].per_run) continue;
    const auto row = static_cast<Eigen::Index>(i);
    POLYEST_ASSIGN_OR_RETURN(next.uncertain[i],
                             PriorAfter(next.uncertain[i], parameters[i], std_dev[row]));
    for (size_t j = 0; j < i; ++j) {
      if (next.uncertain[j].per_run) continue;
      const auto column = static_cast<Eigen::Index>(j);
      const double correlation = covariance(row, column) / (std_dev[row] * std_dev[column]);
      if (correlation == 0) continue;
      next.correlations.push_back(
          {next.uncertain[j].name, next.uncertain[i].name, (1 - kShortened) * correlation});
    }
  }
  return absl::OkStatus();
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
  // The parameters of the first run come first.
  POLYEST_CHECK(estimate.covariance.rows() >= std::ssize(problem.problem().uncertain));
  // For a posterior in several pieces the covariance is that of the heaviest, so its parameters are
  // used.
  const std::vector<ParameterEstimate>& parameters =
      estimate.components.empty() ? estimate.parameters : estimate.components.front().parameters;
  Problem next = problem.problem();
  if (!std::ranges::all_of(parameters, IsPrior)) {
    POLYEST_RETURN_IF_ERROR(TakeParameters(parameters, estimate.covariance, next));
  }
  TakeNoise(estimate, next.measured);
  return ResolvedProblem::Make(std::move(next));
}

}  // namespace polyest::internal
