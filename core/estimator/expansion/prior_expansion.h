#pragma once

// The outputs of a model at the times of a grid as expansions over the whole prior,
// y(t_k, ξ) = c_kᵀ φ(ξ) with c_k = A⁺ Y_k (3)–(10): what the studies that need no data read their
// answers off. The expansion is the paper's, fixed; it does not move.

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

// Times 0, step, 2 step … until, s.
struct TimeGrid {
  double until_s = 0;  // > 0
  double step_s = 0;   // > 0, ≤ until_s

  // INVALID_ARGUMENT names the field, the value and the rule.
  absl::Status Validate() const;
  // until is one of the times when it is a multiple of the step but for rounding.
  int64_t count() const;
  double time_s(int64_t k) const;
  std::vector<double> times_s() const;
};

// RESOURCE_EXHAUSTED when `numbers` for each of the outputs at each time are more than `most`.
absl::Status CheckAnswerSize(const TimeGrid& grid, size_t outputs, int64_t numbers, int64_t most);

// The model's columns of the outputs asked for, or, if none is, of those the problem measures, or,
// if it measures none, of all. INVALID_ARGUMENT names the field `outputs`, the value and the rule.
absl::StatusOr<std::vector<int>> ChooseOutputs(const ResolvedProblem& problem,
                                               const std::vector<std::string>& asked);

// The m outputs at consecutive times: output i at time first_time + k is column k·m + i.
struct ExpandedOutputs {
  int64_t first_time;
  int64_t times;
  Expansion expansion;
  // Of model − expansion at the collocation points, with Q − S degrees of freedom; 0 when Q = S.
  Vector residual_variance;
};

class PriorExpansion {
 public:
  // INVALID_ARGUMENT naming `inputs` when one is streamed, for there are no data to carry it;
  // otherwise as CollocationPoints and CollocationMatrix::Factor. `problem` must outlive it.
  static absl::StatusOr<std::unique_ptr<PriorExpansion>> Make(const ResolvedProblem& problem,
                                                              std::vector<int> outputs,
                                                              int threads);

  const Basis& basis() const { return *basis_; }
  int points() const { return static_cast<int>(points_.rows()); }  // Q
  // Of trajectories that could not be integrated; they are left out of the fit.
  const std::vector<PointFailure>& failures() const { return ensemble_.failures(); }

  // Calls `visit` with all times of the grid, in order, some at a time. Once. FAILED_PRECONDITION
  // when no more than S trajectories are left or an output passes 10¹⁴⁰; a stop request's status.
  absl::Status Run(const TimeGrid& grid, absl::FunctionRef<void(const ExpandedOutputs&)> visit,
                   const Stop& stop);

 private:
  PriorExpansion(const ResolvedProblem& problem, std::vector<int> outputs,
                 std::shared_ptr<const Basis> basis, Matrix points, CollocationMatrix matrix,
                 int threads);

  Matrix Thetas() const;
  absl::Status LeaveOutFailed();
  std::string DescribePoint(int point) const;

  const Prior& prior_;
  std::vector<int> outputs_;
  std::shared_ptr<const Basis> basis_;
  Matrix points_;  // Q × n
  CollocationMatrix matrix_;
  std::vector<int> kept_;  // the points still in the fit
  InputSignals inputs_;
  EnsemblePropagator ensemble_;
};

// POINTS_FAILED, from at least one failure.
Diagnostic DescribeFailures(const std::vector<PointFailure>& failures, int points);

}  // namespace polyest::internal
