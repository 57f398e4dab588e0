#pragma once

// How a model's outputs are expanded in polynomials of the uncertain parameters.

#include <absl/status/status.h>

#include <cstdint>
#include <optional>

namespace polyest {

// Where the model is run to find the expansion: the collocation points.
enum class PointSet {
  kHalton,       // a low-discrepancy sequence in all dimensions
  kHammersley,   // the same with evenly spaced values of the first parameter
  kGaussTensor,  // the tensor grid of Gauss quadrature, (order + 1)ⁿ points; few parameters only
};

// Terms of an expansion past which a problem is RESOURCE_EXHAUSTED.
inline constexpr int64_t kMaxTerms = 2'000;
// Collocation points past which a problem is RESOURCE_EXHAUSTED.
inline constexpr int64_t kMaxPoints = 20'000;

// An expansion has the products of the parameters' polynomials of degrees j_1 … j_n with
// j_1^q + … + j_n^q ≤ p^q: S terms. They are fitted to Q runs of the model.
struct ExpansionOptions {
  // p ≥ 1. Without it an adaptive expansion begins at 3, or less for so many uncertain parameters
  // that 3 is not affordable, and goes up while it is not accurate where the posterior is, as far
  // as that is affordable; any other has the order it would begin with.
  std::optional<int> order = std::nullopt;
  double hyperbolic_exponent = 1;  // q in (0, 1]; 1 is the total degree
  double points_per_term = 2;  // Q = ⌈points_per_term · S⌉; > 1 when adaptive, ≥ 1 otherwise
  PointSet points = PointSet::kHalton;  // where the model is run
  bool adaptive = true;  // expand again where the posterior is; false: over the prior only

  // Returns OK for options that suit n = `dimension` uncertain parameters; INVALID_ARGUMENT or
  // RESOURCE_EXHAUSTED name the field, the value and the rule.
  absl::Status Validate(int dimension) const;
};

}  // namespace polyest
