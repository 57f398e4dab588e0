#include "core/estimator/studies/sensitivity.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/expansion/prior_expansion.h"
#include "core/estimator/problem/assumed_noise.h"
#include "polyest/prior_propagation.h"

namespace polyest::internal {
namespace {

// A variation of an output, or a residual, counts as an integration error if it is at most this
// many times the relative tolerance of the output's largest magnitude.
constexpr double kIntegrationErrors = 10;

// The terms (S × n, 0 or 1) in which each variable occurs, and those in which it occurs alone.
struct TermMasks {
  explicit TermMasks(const Basis& basis)
      : total((basis.indices() > 0).cast<double>().matrix()), first_order(total) {
    for (Eigen::Index s = 0; s < total.rows(); ++s) {
      if (total.row(s).sum() > 1) first_order.row(s).setZero();
    }
  }
  Matrix total;
  Matrix first_order;
};

absl::Status CheckIndependent(const ResolvedProblem& problem) {
  if (!problem.prior().correlated()) return absl::OkStatus();
  const Correlation& pair = problem.problem().correlations.front();
  return InvalidField(
      "correlations",
      absl::StrFormat(
          "%s and %s are correlated (%g), and correlated parameters have no shares of their own in "
          "a variance; leave the correlations out to see what the parameters would do one by one",
          pair.first, pair.second, pair.coefficient));
}

SensitivityAnalysis EmptyAnalysis(const ResolvedProblem& problem, const TimeGrid& grid,
                                  const std::vector<int>& columns) {
  SensitivityAnalysis result;
  result.time_s = grid.times_s();
  for (const auto& parameter : problem.prior().parameters()) {
    result.parameters.push_back(parameter.name);
  }
  const std::vector<Quantity>& outputs = problem.problem().model->description().outputs;
  const auto times = static_cast<Eigen::Index>(result.time_s.size());
  for (const int column : columns) {
    OutputSensitivity output;
    output.output = outputs[static_cast<size_t>(column)].name;
    output.unit = outputs[static_cast<size_t>(column)].unit;
    output.mean.resize(times);
    output.std_dev.resize(times);
    output.residual.resize(times);
    output.first_order = Matrix::Zero(times, problem.dimension());
    output.total = Matrix::Zero(times, problem.dimension());
    result.outputs.push_back(std::move(output));
  }
  return result;
}

// `model_variance` (times × outputs) receives the variance of the model at the draws.
void TakeIndices(const ExpandedOutputs& expanded, const TermMasks& masks,
                 SensitivityAnalysis& result, Matrix& model_variance) {
  const Matrix squares = expanded.expansion.coefficients().cwiseAbs2();
  // Σ c_s² over the terms of each variable, columns × n.
  const Matrix first_order = squares.transpose() * masks.first_order;
  const Matrix total = squares.transpose() * masks.total;
  const Vector mean = expanded.expansion.Mean();
  const Vector deviation = expanded.expansion.StandardDeviation();
  const Vector variance = expanded.ModelVariance();
  const auto m = static_cast<Eigen::Index>(result.outputs.size());
  for (Eigen::Index column = 0; column < mean.size(); ++column) {
    OutputSensitivity& output = result.outputs[static_cast<size_t>(column % m)];
    const Eigen::Index k = expanded.first_time + column / m;
    output.mean[k] = mean[column];
    output.std_dev[k] = deviation[column];
    output.residual[k] = std::sqrt(expanded.residual_variance[column]);
    output.first_order.row(k) = first_order.row(column);
    output.total.row(k) = total.row(column);
    model_variance(k, column % m) = variance[column];
  }
}

double Accuracy(const ResolvedProblem& problem, const OutputSensitivity& output) {
  return kIntegrationErrors * problem.problem().integration.relative_tolerance *
         (output.mean.cwiseAbs() + output.std_dev).maxCoeff();
}

// Turns Σ c_s² into S_i and T_i.
void DivideByVariance(double accuracy, OutputSensitivity& output) {
  for (Eigen::Index k = 0; k < output.mean.size(); ++k) {
    const double deviation = output.std_dev[k];
    if (deviation > accuracy) {
      output.first_order.row(k) /= deviation * deviation;
      output.total.row(k) /= deviation * deviation;
    } else {
      output.first_order.row(k).setZero();
      output.total.row(k).setZero();
    }
  }
}

void TakeNoise(const NoiseModel* given, OutputSensitivity& output) {
  const NoiseModel noise = given != nullptr ? *given : AssumedNoise(output.mean, output.std_dev);
  output.noise.resize(output.mean.size());
  // An output at rest has the noise of a small part of its later range.
  double largest =
      NoiseModel::kMinMagnitude * (output.mean.cwiseAbs() + 2 * output.std_dev).maxCoeff();
  for (Eigen::Index k = 0; k < output.mean.size(); ++k) {
    largest = std::max(largest, std::abs(output.mean[k]));
    // An output that is always 0 has no noise to be compared with; any positive value does.
    output.noise[k] = std::max(std::numeric_limits<double>::min(),
                               noise.StandardDeviation(output.mean[k], largest));
  }
}

// Returns the weights of the trapezoidal rule, up to the factor of the step. The last interval is
// treated as being as long as the others.
Vector TimeWeights(Eigen::Index times) {
  Vector weights = Vector::Ones(times);
  weights[0] = 0.5;
  weights[times - 1] = 0.5;
  return weights;
}

// Ranks by a_i = Σ_o ∫ T_i V/σ_o² dt ÷ Σ_o ∫ V/σ_o² dt.
void RankParameters(SensitivityAnalysis& result) {
  const auto times = static_cast<Eigen::Index>(result.time_s.size());
  const auto n = static_cast<Eigen::Index>(result.parameters.size());
  const Vector weights = TimeWeights(times);
  Vector shares = Vector::Zero(n);
  Vector peaks = Vector::Zero(n);
  double all = 0;
  for (const OutputSensitivity& output : result.outputs) {
    const Vector variance = output.std_dev.cwiseQuotient(output.noise).cwiseAbs2();
    const Matrix of_parameter = variance.asDiagonal() * output.total;
    all += weights.dot(variance);
    shares += of_parameter.transpose() * weights;
    peaks = peaks.cwiseMax(of_parameter.colwise().maxCoeff().transpose());
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    result.activity.push_back({result.parameters[static_cast<size_t>(i)],
                               all > 0 ? shares[i] / all : 0, std::sqrt(peaks[i])});
  }
  std::stable_sort(result.activity.begin(), result.activity.end(),
                   [](const auto& a, const auto& b) { return a.share > b.share; });
}

// Reports by how much of an output's variance over all time (that of the model at the draws of the
// prior: the expansion's own is too large where it leaves the model, and hides this) the expansion
// differs from the model at these draws.
void CheckResidual(const OutputSensitivity& output, const Vector& variance, double accuracy,
                   const std::vector<double>& time_s, std::vector<Diagnostic>& diagnostics) {
  const Vector weights = TimeWeights(output.mean.size());
  const Vector residual =
      (output.residual.array() > accuracy).select(output.residual.cwiseAbs2().array(), 0);
  const double unexplained = weights.dot(residual);
  const double all = weights.dot(variance);
  if (unexplained <= kUnexplained * all) return;
  Eigen::Index first = 0;
  while (residual[first] <= kUnexplained * variance[first]) ++first;
  diagnostics.push_back(
      {DiagnosticCode::kExpansionInaccurate,
       absl::StrFormat(
           "at draws of the prior the expansion differs from the model by %.2g %% of the "
           "variance of %s, and at t = %g s for the first time by more than %g %%: its "
           "indices and the ranking are wrong by as much; narrower priors bring it "
           "down, or a higher order if the residual falls with it",
           100 * unexplained / all, output.output, time_s[static_cast<size_t>(first)],
           100 * kUnexplained)});
}

void Diagnose(const ResolvedProblem& problem, const PriorExpansion& expansion,
              const Matrix& model_variance, SensitivityAnalysis& result) {
  for (size_t i = 0; i < result.outputs.size(); ++i) {
    const OutputSensitivity& output = result.outputs[i];
    CheckResidual(output, model_variance.col(static_cast<Eigen::Index>(i)),
                  Accuracy(problem, output), result.time_s, result.diagnostics);
  }
  if (!expansion.failures().empty()) {
    result.diagnostics.push_back(DescribeFailures(expansion.failures(), expansion.trajectories()));
  }
}

}  // namespace

}  // namespace polyest::internal

namespace polyest {

using namespace internal;

absl::Status SensitivityOptions::Validate() const {
  POLYEST_RETURN_IF_ERROR((TimeGrid{until_s, step_s}.Validate()));
  POLYEST_RETURN_IF_ERROR(CheckRange("draws", draws, kMinPriorDraws, kMaxPriorDraws));
  return CheckAtLeast("threads", threads, 1);
}

}  // namespace polyest

namespace polyest::internal {

absl::StatusOr<SensitivityAnalysis> AnalyzeSensitivity(const ResolvedProblem& problem,
                                                       const SensitivityOptions& options,
                                                       const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_RETURN_IF_ERROR(CheckIndependent(problem));
  POLYEST_ASSIGN_OR_RETURN(const std::vector<int> columns, ChooseOutputs(problem, options.outputs));
  const TimeGrid grid{options.until_s, options.step_s};
  POLYEST_RETURN_IF_ERROR(
      CheckAnswerSize(grid, columns.size(), 5 + 2 * problem.dimension(), kMaxPropagatedValues));
  POLYEST_ASSIGN_OR_RETURN(
      const auto expansion,
      PriorExpansion::Make(problem, columns, options.draws, options.threads, stop));
  SensitivityAnalysis result = EmptyAnalysis(problem, grid, columns);
  const TermMasks masks(expansion->basis());
  Matrix model_variance(grid.count(), static_cast<Eigen::Index>(columns.size()));
  POLYEST_RETURN_IF_ERROR(expansion->Run(
      grid,
      [&](const ExpandedOutputs& expanded) {
        TakeIndices(expanded, masks, result, model_variance);
      },
      stop));
  for (size_t i = 0; i < columns.size(); ++i) {
    OutputSensitivity& output = result.outputs[i];
    DivideByVariance(Accuracy(problem, output), output);
    TakeNoise(GivenNoise(problem, columns[i]), output);
  }
  RankParameters(result);
  result.order = expansion->basis().order();
  result.terms = expansion->basis().size();
  result.points = expansion->points();
  result.draws = expansion->draws();
  Diagnose(problem, *expansion, model_variance, result);
  return result;
}

}  // namespace polyest::internal
