#pragma once

// The limit of outputs. Mismatch sums hold squares of coefficients divided by variances, and costs
// multiply them by squares again; one sum that overflows to ∞ would make every later one not a
// number. A trajectory with an output beyond the limit therefore fails like one that cannot be
// integrated. An output within the limit leaves room for variances down to 10⁻¹⁰⁰.

#include <Eigen/Core>

namespace polyest::internal {

inline constexpr double kMaxOutput = 1e100;  // magnitude, in the output's unit

// Returns why a trajectory with these outputs (an array of any shape) must fail; null if it need
// not.
template <typename Derived>
const char* FailureOfOutputs(const Eigen::ArrayBase<Derived>& outputs) {
  if (!outputs.isFinite().all()) return "an output is not finite";
  if ((outputs.abs() > kMaxOutput).any()) return "an output exceeds 1e100 in magnitude";
  return nullptr;
}

}  // namespace polyest::internal
