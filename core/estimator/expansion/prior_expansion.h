#pragma once

// Expansions of a model's outputs over the whole prior at the times of a grid, y(t_k, ξ) = c_kᵀ
// φ(ξ) with c_k = A⁺ Y_k, equations (3) to (10). The studies that need no data derive their results
// from them. This is the paper's fixed expansion: its region does not move.
//
// The model itself runs at further points, too, which are draws of the prior and in no fit. The
// fit's own residuals cannot tell how wrong the expansion is: with few points to spare they are
// small by construction, and they end where the points end, while a polynomial grows fastest in the
// tails that the prior still has beyond them.

#include <absl/functional/function_ref.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/chaos/collocation_matrix.h"
#include "core/chaos/expansion.h"
#include "core/estimator/problem/resolved_problem.h"
#include "core/propagation/ensemble_propagator.h"
#include "polyest/diagnostic.h"
#include "polyest/stop.h"

namespace polyest::internal {

// The times 0, step, 2 step, …, until, in s.
struct TimeGrid {
  double until_s = 0;  // > 0
  double step_s = 0;   // > 0, ≤ until_s

  // Returns InvalidArgument that names the field, the value and the rule if the grid is invalid.
  absl::Status Validate() const;
  // Returns the number of times. `until` is one of them when it is a multiple of the step up to
  // rounding.
  int64_t count() const;
  double time_s(int64_t k) const;
  std::vector<double> times_s() const;
};

// Returns ResourceExhausted when `numbers` values for each output at each time exceed `most` in
// total.
absl::Status CheckAnswerSize(const TimeGrid& grid, size_t outputs, int64_t numbers, int64_t most);

// Returns the model's columns of the requested outputs, among which are the parameters that drift.
// Without a request these are the outputs that the problem measures, or all outputs if it measures
// none, and what drifts. Returns InvalidArgument that names
// the field `outputs`, the value and the rule.
absl::StatusOr<std::vector<int>> ChooseOutputs(const ResolvedProblem& problem,
                                               const std::vector<std::string>& asked);

// Returns InvalidArgument where a study that needs no data is not possible: with a likelihood of
// prediction errors, or naming `inputs` when an input is streamed, because there are no data to
// provide it.
absl::Status CheckIsOfThePrior(const ResolvedProblem& problem);

// Propagates an ensemble of m outputs over the grid, and calls `visit` for successive stretches of
// times that cover it in order, with the first time's number and the values, Q × m times: output i
// at time first + k is column k·m + i. Ends with the first error of `visit`, or the status of a
// stop request.
absl::Status PropagateOver(const TimeGrid& grid, int64_t m, EnsemblePropagator& ensemble,
                           absl::FunctionRef<absl::Status(int64_t, const Matrix&)> visit,
                           const Stop& stop);

// The expansions of m outputs at consecutive times. Output i at time first_time + k is column k·m +
// i.
struct ExpandedOutputs {
  int64_t first_time;
  int64_t times;
  Expansion expansion;
  // The model at the draws of the prior that could be integrated up to the last of these times,
  // draws × columns.
  Matrix model;
  Vector residual_variance;  // mean square of model − expansion at these draws

  // Returns the variance of the model over these draws, as of a sample, for each column.
  Vector ModelVariance() const;
};

class PriorExpansion {
 public:
  // Makes the expansion of `outputs`, and `draws` ≥ 2 draws of the prior. Errors are those of
  // CheckIsOfThePrior, CollocationPoints and CollocationMatrix::Factor. `problem` must outlive the
  // expansion.
  static absl::StatusOr<std::unique_ptr<PriorExpansion>> Make(const ResolvedProblem& problem,
                                                              std::vector<int> outputs, int draws,
                                                              int threads, const Stop& stop);

  const Basis& basis() const { return *basis_; }
  int points() const { return static_cast<int>(points_.rows()); }  // Q
  int draws() const { return static_cast<int>(draws_.rows()); }
  int trajectories() const { return points() + draws(); }
  // Returns the trajectories that could not be integrated, of the collocation points (from 0) and
  // of the draws (from Q). They are left out.
  const std::vector<PointFailure>& failures() const { return ensemble_.failures(); }

  // Calls `visit` for successive stretches of times that cover the grid in order. May be called
  // only once. Returns FailedPrecondition when at most S trajectories of collocation points or
  // fewer than two of draws are left, or the status of a stop request.
  absl::Status Run(const TimeGrid& grid, absl::FunctionRef<void(const ExpandedOutputs&)> visit,
                   const Stop& stop);

 private:
  PriorExpansion(const ResolvedProblem& problem, std::vector<int> outputs,
                 std::shared_ptr<const Basis> basis, Matrix points, CollocationMatrix matrix,
                 int draws, int threads);

  Matrix Thetas() const;
  ExpandedOutputs Expand(int64_t first, const Matrix& values);
  absl::Status LeaveOutFailed(const Stop& stop);
  absl::Status TooFewLeft() const;
  std::string DescribePoint(int point) const;

  const Prior& prior_;
  std::vector<int> outputs_;
  std::shared_ptr<const Basis> basis_;
  Matrix points_;  // Q × n
  CollocationMatrix matrix_;
  Matrix draws_;       // of the prior, draws × n
  Matrix draw_basis_;  // φ at the draws, draws × S
  // The rows of the ensemble in use: points still in the fit, and draws.
  std::vector<int> kept_points_;
  std::vector<int> kept_draws_;
  InputSignals inputs_;
  EnsemblePropagator ensemble_;
};

// Returns POINTS_FAILED for at least one failure among `points` trajectories.
Diagnostic DescribeFailures(const std::vector<PointFailure>& failures, int points);

}  // namespace polyest::internal
