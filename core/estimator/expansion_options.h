#pragma once

// How the outputs are expanded, and the truncations that follow from it.

#include <absl/status/status.h>

#include <cstdint>
#include <optional>

#include "core/chaos/collocation_points.h"
#include "core/chaos/multi_index.h"

namespace polyest {

// Limits that keep one problem from taking a machine: past them RESOURCE_EXHAUSTED.
inline constexpr int64_t kMostTerms = 2'000;    // S
inline constexpr int64_t kMostPoints = 20'000;  // Q

struct ExpansionOptions {
  // p ≥ 1 of the truncation. Without it an adaptive expansion begins at 3, or less for so many
  // uncertain parameters that 3 is not affordable, and goes up while it is not accurate where the
  // posterior is, as far as that is affordable; any other has the order it would begin with.
  std::optional<int> order = std::nullopt;
  double hyperbolic_exponent = 1;  // q in (0, 1] of the truncation; 1 is the total degree
  double points_per_term = 2;  // Q = ⌈points_per_term · S⌉; > 1 when adaptive, ≥ 1 otherwise
  PointSet points = PointSet::kHalton;
  bool adaptive = true;  // re-expand where the posterior is; false is the paper's fixed expansion

  // Of an expansion in n uncertain parameters. INVALID_ARGUMENT or RESOURCE_EXHAUSTED name the
  // field, the value and the rule.
  absl::Status Validate(int dimension) const;
};

// How α² is chosen (bayes/regularization.h); where a rule has no answer, 1.
// The truncation an expansion in n uncertain parameters begins with.
Truncation FirstTruncation(const ExpansionOptions& options, int dimension);
// Of two orders more, or one; nothing when the order is given or more is not affordable: past 500
// terms or order 9, beyond which two points a term no longer determine the terms well.
std::optional<Truncation> NextTruncation(const ExpansionOptions& options, int dimension,
                                         const Truncation& present);

}  // namespace polyest
