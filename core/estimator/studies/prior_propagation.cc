#include "core/estimator/studies/prior_propagation.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/expansion/prior_expansion.h"

namespace polyest::internal {
namespace {

Propagation EmptyPropagation(const ResolvedProblem& problem, const PropagationOptions& options,
                             const TimeGrid& grid, const std::vector<int>& columns) {
  const std::vector<Quantity>& outputs = problem.problem().model->description().outputs;
  Propagation result;
  result.time_s = grid.times_s();
  const auto times = static_cast<Eigen::Index>(result.time_s.size());
  for (const int column : columns) {
    PropagatedOutput output;
    output.output = outputs[static_cast<size_t>(column)].name;
    output.unit = outputs[static_cast<size_t>(column)].unit;
    output.mean.resize(times);
    output.std_dev.resize(times);
    output.residual.resize(times);
    output.quantiles.resize(times, static_cast<Eigen::Index>(options.probabilities.size()));
    result.outputs.push_back(std::move(output));
  }
  return result;
}

void DescribeDistribution(const ConstVectorRef& samples, Eigen::Index k,
                          const PropagationOptions& options, PropagatedOutput& output) {
  Vector sorted = samples;
  std::sort(sorted.begin(), sorted.end());
  for (size_t i = 0; i < options.probabilities.size(); ++i) {
    output.quantiles(k, static_cast<Eigen::Index>(i)) =
        QuantileOfSorted(sorted, options.probabilities[i]);
  }
  if (options.density_bins > 0) {
    output.densities.push_back(DensityOfSamples(sorted, options.density_bins));
  }
}

// Derives the results at some times. The expansion's numbers are as wrong as the expansion is at
// the draws, and those of the draws as a mean of as many independent draws would be; the more
// accurate ones count.
void Describe(const ExpandedOutputs& expanded, const PropagationOptions& options,
              Propagation& result) {
  const bool sampled = !options.probabilities.empty() || options.density_bins > 0;
  const Matrix samples = sampled ? expanded.expansion.Sample(options.density_samples) : Matrix();
  const Vector mean = expanded.expansion.Mean();
  const Vector deviation = expanded.expansion.StandardDeviation();
  const auto m = static_cast<Eigen::Index>(result.outputs.size());
  const auto draws = static_cast<double>(expanded.model.rows());
  const Vector model_variance = expanded.ModelVariance();
  for (Eigen::Index column = 0; column < mean.size(); ++column) {
    PropagatedOutput& output = result.outputs[static_cast<size_t>(column % m)];
    const Eigen::Index k = expanded.first_time + column / m;
    const auto model = expanded.model.col(column);
    const double model_deviation = std::sqrt(model_variance[column]);
    const double residual = std::sqrt(expanded.residual_variance[column]);
    const double standard_error = model_deviation / std::sqrt(draws);
    const bool from_draws = residual > standard_error;
    output.mean[k] = from_draws ? model.mean() : mean[column];
    output.std_dev[k] = from_draws ? model_deviation : deviation[column];
    output.residual[k] = from_draws ? standard_error : residual;
    output.from_draws.push_back(from_draws);
    if (!sampled) continue;
    DescribeDistribution(from_draws ? model : samples.col(column), k, options, output);
  }
}

// Draws that fail are missing where they count, and nothing tells what they would have said.
void Diagnose(const PriorExpansion& expansion, Propagation& result) {
  if (expansion.failures().empty()) return;
  result.diagnostics.push_back(DescribeFailures(expansion.failures(), expansion.trajectories()));
  for (const PropagatedOutput& output : result.outputs) {
    const auto first = std::find(output.from_draws.begin(), output.from_draws.end(), true);
    if (first == output.from_draws.end()) continue;
    const auto k = static_cast<size_t>(first - output.from_draws.begin());
    result.diagnostics.push_back(
        {DiagnosticCode::kExpansionInaccurate,
         absl::StrFormat("at t = %g s for the first time the expansion does not follow %s, and not "
                         "all draws of the prior that stand in for it could be integrated: mean, "
                         "standard deviation and quantiles are those of the others; a prior "
                         "without the values at which the model fails makes them right",
                         result.time_s[k], output.output)});
  }
}

}  // namespace

}  // namespace polyest::internal

namespace polyest {

using namespace internal;

absl::Status PropagationOptions::Validate() const {
  POLYEST_RETURN_IF_ERROR((TimeGrid{until_s, step_s}.Validate()));
  for (size_t i = 0; i < probabilities.size(); ++i) {
    if (probabilities[i] >= 0 && probabilities[i] <= 1) continue;
    return InvalidField(FieldPath{"probabilities", i},
                        absl::StrFormat("%g must lie between 0 and 1", probabilities[i]));
  }
  POLYEST_RETURN_IF_ERROR(CheckRange("density_bins", density_bins, 0, kMaxDensityBins));
  POLYEST_RETURN_IF_ERROR(CheckRange("density_samples", density_samples, 1, kMaxDensitySamples));
  POLYEST_RETURN_IF_ERROR(CheckRange("draws", draws, kMinPriorDraws, kMaxPriorDraws));
  return CheckAtLeast("threads", threads, 1);
}

}  // namespace polyest

namespace polyest::internal {

absl::StatusOr<Propagation> PropagatePrior(const ResolvedProblem& problem,
                                           const PropagationOptions& options, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_ASSIGN_OR_RETURN(const std::vector<int> columns, ChooseOutputs(problem, options.outputs));
  const TimeGrid grid{options.until_s, options.step_s};
  const auto numbers = static_cast<int64_t>(4 + options.probabilities.size() +
                                            2 * static_cast<size_t>(options.density_bins));
  // A larger result needs a different tool, not more memory.
  POLYEST_RETURN_IF_ERROR(CheckAnswerSize(grid, columns.size(), numbers, kMaxPropagatedValues));
  POLYEST_ASSIGN_OR_RETURN(
      const auto expansion,
      PriorExpansion::Make(problem, columns, options.draws, options.threads, stop));
  Propagation result = EmptyPropagation(problem, options, grid, columns);
  POLYEST_RETURN_IF_ERROR(expansion->Run(
      grid, [&](const ExpandedOutputs& expanded) { Describe(expanded, options, result); }, stop));
  result.order = expansion->basis().order();
  result.terms = expansion->basis().size();
  result.points = expansion->points();
  result.draws = expansion->draws();
  result.failures = expansion->failures();
  Diagnose(*expansion, result);
  return result;
}

}  // namespace polyest::internal
