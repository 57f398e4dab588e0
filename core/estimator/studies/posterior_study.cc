#include "core/estimator/studies/posterior_study.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/studies/sample_choice.h"
#include "core/estimator/studies/study_options.h"

namespace polyest::internal {
namespace {

constexpr int kImportancePoints = 65'536;
constexpr double kChainEffectiveSize = 60'000;
constexpr int kMaxSweeps = 2'000;
// Number of importance points for each returned sample; hardly any point is then returned twice.
constexpr int kPointsPerSample = 4;

absl::Status CheckJoint(const Prior& prior, size_t index,
                        const std::pair<std::string, std::string>& joint) {
  for (const std::string& name : {joint.first, joint.second}) {
    POLYEST_RETURN_IF_ERROR(FindUncertain(prior, FieldPath{"joints", index}, name).status());
  }
  if (joint.first == joint.second) {
    return InvalidField(
        FieldPath{"joints", index},
        absl::StrFormat("%s is given twice; a pair is of two parameters", joint.first));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status Validate(const PosteriorOptions& options, const Prior& prior) {
  POLYEST_RETURN_IF_ERROR(CheckProbabilities(options.probabilities));
  POLYEST_RETURN_IF_ERROR(CheckRange("density_bins", options.density_bins, 0, kMaxPosteriorBins));
  POLYEST_RETURN_IF_ERROR(CheckRange("joint_bins", options.joint_bins, 1, kMaxJointBins));
  POLYEST_RETURN_IF_ERROR(CheckRange("samples", options.samples, 0, kMaxPosteriorSamples));
  if (options.joints.size() > kMaxJointDensities) {
    return InvalidField("joints", absl::StrFormat("%d are given; the limit is %d",
                                                  options.joints.size(), kMaxJointDensities));
  }
  for (size_t i = 0; i < options.joints.size(); ++i) {
    POLYEST_RETURN_IF_ERROR(CheckJoint(prior, i, options.joints[i]));
  }
  return absl::OkStatus();
}

PosteriorEffort EffortOf(const PosteriorOptions& options) {
  PosteriorEffort effort;
  effort.importance_points = std::max(kImportancePoints, kPointsPerSample * options.samples);
  effort.chain_effective_size = kChainEffectiveSize;
  effort.max_sweeps = kMaxSweeps;
  effort.evidence = true;
  return effort;
}

Posterior DescribePosterior(const Assessed& assessed, const Prior& prior,
                            const PosteriorOptions& options) {
  const PosteriorDraws& draws = assessed.posterior;
  const Vector& weights = draws.weights;
  Matrix thetas(draws.scores.rows(), prior.dimension());
  Posterior posterior;
  for (int i = 0; i < prior.dimension(); ++i) {
    thetas.col(i) = draws.Parameter(prior, i);
    const ParameterEstimate& estimate = assessed.estimate.parameters[static_cast<size_t>(i)];
    PosteriorMarginal marginal;
    marginal.parameter = estimate.name;
    marginal.unit = estimate.unit;
    marginal.mean = WeightedMean(thetas.col(i), weights);
    marginal.std_dev = WeightedStandardDeviation(thetas.col(i), weights);
    const WeightedQuantiles quantile(thetas.col(i), weights);
    marginal.quantiles.resize(static_cast<Eigen::Index>(options.probabilities.size()));
    std::transform(options.probabilities.begin(), options.probabilities.end(),
                   marginal.quantiles.begin(), quantile);
    if (options.density_bins > 0) {
      marginal.density = WeightedDensity(thetas.col(i), weights, options.density_bins);
    }
    marginal.effective_size = draws.effective_size[i];
    if (draws.r_hat.size() > 0) marginal.r_hat = draws.r_hat[i];
    posterior.marginals.push_back(std::move(marginal));
  }
  const auto column = [&](const std::string& name) {
    return thetas.col(FindUncertain(prior, "joints", name).value());
  };
  for (const auto& [first, second] : options.joints) {
    posterior.joints.push_back(
        {first, second,
         WeightedJointDensity(column(first), column(second), weights, options.joint_bins)});
  }
  SampleChoice choice = ChooseSamples(draws.weights, draws.chain, options.samples);
  posterior.samples = thetas(choice.draws, Eigen::all);
  posterior.sample_chains = std::move(choice.groups);
  posterior.method = draws.method;
  posterior.draws = draws.scores.rows();
  posterior.effective_size = draws.effective_size.minCoeff();
  if (draws.r_hat.size() > 0) posterior.r_hat = draws.r_hat.maxCoeff();
  posterior.diagnostics = assessed.estimate.diagnostics;
  posterior.log_evidence = assessed.log_evidence;
  posterior.time_s = assessed.estimate.time_s;
  posterior.sample_values = assessed.estimate.samples;
  return posterior;
}

}  // namespace polyest::internal
