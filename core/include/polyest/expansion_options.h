#pragma once

// How a model's outputs are expanded in polynomials of the uncertain parameters.

#include <absl/status/status.h>

#include <cstdint>
#include <optional>

namespace polyest {

// Where the model is run to find the expansion: the collocation points.
enum class PointSet {
  kHalton,      // a low-discrepancy sequence in all dimensions
  kHammersley,  // the same with evenly spaced values of the first parameter
  // The tensor grid of Gauss quadrature over the prior, (order + 1)ⁿ points; for few parameters. An
  // expansion made again elsewhere has points_per_term points per term.
  kGaussTensor,
};

// Terms of an expansion past which a problem is RESOURCE_EXHAUSTED.
inline constexpr int64_t kMaxTerms = 2'000;
// Collocation points past which a problem is RESOURCE_EXHAUSTED.
inline constexpr int64_t kMaxPoints = 20'000;

// An expansion has the products of the parameters' polynomials of degrees j_1 … j_n with
// j_1^q + … + j_n^q ≤ p^q: S terms. They are fitted to Q runs of the model.
struct ExpansionOptions {
  // p ≥ 1. Without it an adaptive expansion begins with order 3, or with less if order 3 has more
  // than 250 terms. The order rises, to at most 9 and 500 terms (1,001 at order 4), if the
  // posterior is so wide that the present order does not follow the model and a higher one does. An
  // expansion that is not adaptive keeps its first order.
  std::optional<int> order = std::nullopt;
  double hyperbolic_exponent = 1;  // q in (0, 1]; 1 is the total degree
  double points_per_term = 2;  // Q = ⌈points_per_term · S⌉; > 1 when adaptive, ≥ 1 otherwise
  PointSet points = PointSet::kHalton;  // where the model is run
  bool adaptive = true;  // expand again where the posterior is; false: over the prior only
  // The most rows that an update propagates again, ≥ 4 · integration.samples_between_checkpoints;
  // without a value there is no limit. While the record grows by B rows, each component of the
  // posterior propagates at most as many rows again, and B: once the record is longer, the
  // expansion moves only as far as its sums can be carried over. What is put off is said by
  // DiagnosticCode::kReplayPostponed. Not available with parameters of each run.
  std::optional<int64_t> max_replay_row_count = std::nullopt;

  // Returns OK for options that suit n = `dimension` uncertain parameters; INVALID_ARGUMENT or
  // RESOURCE_EXHAUSTED name the field, the value and the rule.
  absl::Status Validate(int dimension) const;
};

}  // namespace polyest
