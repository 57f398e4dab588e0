#pragma once

// The exact posterior of a small problem: on a grid over ν, and over log σ where the noise is
// unknown, the posterior of β is normal,
//   Λ = P⁻¹ + XᵀX/σ²,  Λ m = P⁻¹ m_0 + Xᵀ(z − g_0)/σ²,
// and the node's weight is its prior density times the evidence. Cells near the maximum are
// divided until the moments stay.

#include <optional>

#include "tests/properties/problems.h"

namespace polyest::internal::properties {

struct Moments {
  Vector mean, std_dev;  // of ν, then of β
};

// Returns the moments to within about 0.02 standard deviations, or nothing if the grid could not
// reach that.
std::optional<Moments> ExactPosterior(const SmallProblem& problem);

}  // namespace polyest::internal::properties
