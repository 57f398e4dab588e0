#pragma once

#include <utility>

#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

// Resolves a problem that is right.
inline ResolvedProblem Resolve(Problem problem) {
  return ResolvedProblem::Make(std::move(problem)).value();
}

}  // namespace polyest::internal
