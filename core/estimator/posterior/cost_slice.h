#pragma once

// The least of a function of η on one of the parallel hyperplanes aᵀη = b, in the box and the
// constraints of its minimization.

#include <optional>
#include <vector>

#include "core/bayes/minimizer.h"

namespace polyest::internal {

// On a hyperplane η = base + N v, with N an orthonormal basis of the directions in it and base the
// first start's nearest point in it.
class CostSlice {
 public:
  // normal: a (n), not 0. `search` must outlive it.
  CostSlice(const MinimizationProblem& search, const Vector& normal);

  // From at least one start η, not necessarily in the hyperplane; none where the function is
  // nowhere finite.
  std::optional<Minimum> Minimize(double b, const std::vector<Vector>& starts,
                                  const Stop& stop) const;

 private:
  void KeepRowsThatCross();
  Vector ToSlice(const Vector& eta, double b) const;

  const MinimizationProblem& search_;
  Vector a_;
  Matrix n_;
  Matrix rows_;  // of the box and the constraints: rows η ≤ bounds
  Vector bounds_;
};

}  // namespace polyest::internal
