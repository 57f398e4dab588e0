#pragma once

// Minimizes a function of η on one of the parallel hyperplanes aᵀη = b, within the box and the
// constraints of its minimization problem.

#include <optional>
#include <vector>

#include "core/bayes/minimizer.h"

namespace polyest::internal {

// Points of a hyperplane are η = base + N v. N is an orthonormal basis of its directions, and base
// is the point of the hyperplane nearest to the first start.
class CostSlice {
 public:
  // `normal` is a (n), which must not be 0. `search` must outlive the slice.
  CostSlice(const MinimizationProblem& search, const Vector& normal);

  // Returns the minimum found from at least one start η, which need not lie in the hyperplane.
  // Returns nothing if the function is nowhere finite.
  std::optional<Minimum> Minimize(double b, const std::vector<Vector>& starts,
                                  const Stop& stop) const;

 private:
  void KeepRowsThatCross();
  Vector ToSlice(const Vector& eta, double b) const;

  const MinimizationProblem& search_;
  Vector a_;
  Matrix n_;
  Matrix rows_;  // rows of the box and the constraints: rows η ≤ bounds
  Vector bounds_;
};

}  // namespace polyest::internal
