#include "polyest/expansion_options.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

#include "core/chaos/multi_index.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/problem/truncation.h"

namespace polyest {

using namespace internal;

absl::Status ExpansionOptions::Validate(int dimension) const {
  if (order) POLYEST_RETURN_IF_ERROR(CheckAtLeast("expansion.order", *order, 1));
  if (!(hyperbolic_exponent > 0 && hyperbolic_exponent <= 1)) {
    return InvalidField("expansion.hyperbolic_exponent",
                        absl::StrFormat("%g must be in (0, 1]", hyperbolic_exponent));
  }
  if (!std::isfinite(points_per_term) || points_per_term < 1) {
    return InvalidField("expansion.points_per_term",
                        absl::StrFormat("%g must be at least 1", points_per_term));
  }
  const Truncation truncation = FirstTruncation(*this, dimension);
  const int64_t terms = TermCount(dimension, truncation, kMaxTerms);
  if (terms > kMaxTerms) {
    return FieldError(
        absl::StatusCode::kResourceExhausted, "expansion.order",
        absl::StrFormat("order %d of %d uncertain parameters needs more than %d terms, the limit",
                        truncation.order, dimension, kMaxTerms));
  }
  const double count = PointCountOnPrior(*this, dimension, truncation, static_cast<double>(terms));
  if (count > static_cast<double>(kMaxPoints)) {
    return FieldError(
        absl::StatusCode::kResourceExhausted, "expansion",
        absl::StrFormat("%.0f collocation points are needed; the limit is %d", count, kMaxPoints));
  }
  const double fewest = std::min(count, PointCount(*this, static_cast<double>(terms)));
  if (adaptive && fewest <= static_cast<double>(terms)) {
    return InvalidField("expansion.points_per_term",
                        absl::StrFormat("%g gives %.0f points for %d terms; an adaptive expansion "
                                        "needs more points than terms to see its own error",
                                        points_per_term, fewest, terms));
  }
  return absl::OkStatus();
}

}  // namespace polyest
