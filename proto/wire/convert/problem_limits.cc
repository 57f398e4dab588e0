#include "proto/wire/convert/problem_limits.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/common/status.h"
#include "core/estimator/problem/truncation.h"
#include "proto/wire/convert/problem.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

// Returns the largest number of collocation points that an expansion may have as its order rises.
double MaxPointsOf(const ExpansionOptions& options, int dimension) {
  Truncation truncation = FirstTruncation(options, dimension);
  double most =
      options.points == PointSet::kGaussTensor ? std::pow(truncation.order + 1, dimension) : 0;
  std::optional<Truncation> next = truncation;
  while (next) {
    truncation = *next;
    const auto terms = static_cast<double>(TermCount(dimension, truncation, kMaxTerms));
    most = std::max(most, std::ceil(options.points_per_term * terms));
    next = options.adaptive ? NextTruncation(options, dimension, truncation) : std::nullopt;
  }
  return most;
}

}  // namespace

absl::Status CheckLimits(const ProblemLimits& limits, const ResolvedProblem& problem) {
  if (problem.dimension() > limits.parameters) {
    return LimitExceeded(
        "--max-parameters",
        absl::StrFormat("uncertain: %d parameters, those of all runs together, are more than a "
                        "problem may have, %d (--max-parameters)",
                        problem.dimension(), limits.parameters));
  }
  const auto states = static_cast<int64_t>(problem.problem().model->description().states.size());
  if (states > limits.states) {
    return LimitExceeded("--max-states",
                         absl::StrFormat("model: %d states are more than a model may have, %d "
                                         "(--max-states)",
                                         states, limits.states));
  }
  const double points = MaxPointsOf(problem.problem().expansion, problem.dimension());
  if (points > static_cast<double>(limits.points)) {
    return LimitExceeded(
        "--max-points",
        absl::StrFormat("expansion: up to %.0f collocation points are more than a problem may "
                        "have, %d (--max-points); a lower order needs fewer",
                        points, limits.points));
  }
  return absl::OkStatus();
}

absl::Status CheckRuns(const ProblemLimits& limits, const ResolvedProblem& problem,
                       const v1::Measurements& batch) {
  if (!problem.per_run() || batch.run().empty()) return absl::OkStatus();
  const int last = *std::max_element(batch.run().begin(), batch.run().end());
  // The estimator reports other errors of a run more precisely: it knows the row.
  if (last < problem.runs() || last >= problem.max_runs()) return absl::OkStatus();
  // Beyond the runs of one expansion, more of them add no parameters.
  const auto with_runs = problem.WithRuns(std::min(last + 1, problem.max_joint_runs()));
  return with_runs.ok() ? CheckLimits(limits, *with_runs) : absl::OkStatus();
}

absl::StatusOr<ResolvedProblem> ToProblem(const v1::Problem& problem, const ModelLibrary& models,
                                          const ProblemLimits& limits) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem resolved, ToProblem(problem, models));
  POLYEST_RETURN_IF_ERROR(CheckLimits(limits, resolved));
  return resolved;
}

}  // namespace polyest::internal
