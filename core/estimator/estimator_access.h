#pragma once

// Access to an estimator for polyest's own programs, which have already resolved their problem.

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/estimator.h"

namespace polyest::internal {

class EstimatorAccess {
 public:
  // Makes an estimator for a resolved problem; otherwise like Estimator::Make.
  static absl::StatusOr<std::unique_ptr<Estimator>> Make(ResolvedProblem problem,
                                                         EstimatorOptions options = {},
                                                         const Stop& stop = {});
  // Returns the estimator's problem, resolved for the runs appended so far.
  static const ResolvedProblem& ProblemOf(const Estimator& estimator);
  // Returns about how many bytes of memory the estimator holds, without its rows.
  static int64_t MemoryBytes(const Estimator& estimator);
};

}  // namespace polyest::internal
