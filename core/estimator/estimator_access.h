#pragma once

// Ways into an estimator for polyest's own programs, which have their problem resolved already.

#include <absl/status/statusor.h>

#include <memory>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/estimator.h"

namespace polyest::internal {

class EstimatorAccess {
 public:
  // Makes an estimator; otherwise as Estimator::Make.
  static absl::StatusOr<std::unique_ptr<Estimator>> Make(ResolvedProblem problem,
                                                         EstimatorOptions options = {});
  // Returns the estimator's problem, resolved for the runs appended.
  static const ResolvedProblem& ProblemOf(const Estimator& estimator);
};

}  // namespace polyest::internal
