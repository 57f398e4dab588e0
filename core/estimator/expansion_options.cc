#include "core/estimator/expansion_options.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

namespace polyest {
namespace {

constexpr int kFirstOrder = 3;
constexpr int kLastOrder = 9;
constexpr int64_t kAffordableTerms = 500;
// An expansion that may yet grow should begin well below what is affordable.
constexpr int64_t kAffordableAtFirst = 250;

}  // namespace

absl::Status ExpansionOptions::Validate(int dimension) const {
  if (order && *order < 1) {
    return absl::InvalidArgumentError(
        absl::StrFormat("expansion.order: %d must be at least 1", *order));
  }
  if (!(hyperbolic_exponent > 0 && hyperbolic_exponent <= 1)) {
    return absl::InvalidArgumentError(
        absl::StrFormat("expansion.hyperbolicExponent: %g must be in (0, 1]", hyperbolic_exponent));
  }
  if (!std::isfinite(points_per_term) || points_per_term < 1) {
    return absl::InvalidArgumentError(
        absl::StrFormat("expansion.pointsPerTerm: %g must be at least 1", points_per_term));
  }
  const Truncation truncation = FirstTruncation(*this, dimension);
  const int64_t terms = TermCount(dimension, truncation, kMostTerms);
  if (terms > kMostTerms) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "expansion.order: order %d of %d uncertain parameters needs more than %d terms, the limit",
        truncation.order, dimension, kMostTerms));
  }
  const double count = points == PointSet::kGaussTensor
                           ? std::pow(truncation.order + 1, dimension)
                           : std::ceil(points_per_term * static_cast<double>(terms));
  if (count > static_cast<double>(kMostPoints)) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "expansion: %.0f collocation points are needed; the limit is %d", count, kMostPoints));
  }
  // A tensor grid is of the prior alone; a moved expansion has points_per_term points a term.
  const double moved = std::ceil(points_per_term * static_cast<double>(terms));
  const double fewest = std::min(count, moved);
  if (adaptive && fewest <= static_cast<double>(terms)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "expansion.pointsPerTerm: %g gives %.0f points for %d terms; an adaptive expansion needs "
        "more points than terms to see its own error",
        points_per_term, fewest, terms));
  }
  return absl::OkStatus();
}

Truncation FirstTruncation(const ExpansionOptions& options, int dimension) {
  if (options.order) return {*options.order, options.hyperbolic_exponent};
  Truncation truncation{kFirstOrder, options.hyperbolic_exponent};
  while (truncation.order > 1 &&
         TermCount(dimension, truncation, kAffordableAtFirst) > kAffordableAtFirst) {
    --truncation.order;
  }
  return truncation;
}

std::optional<Truncation> NextTruncation(const ExpansionOptions& options, int dimension,
                                         const Truncation& present) {
  if (options.order) return std::nullopt;
  // One order alone would bring nothing to even or odd functions.
  for (const int more : {2, 1}) {
    const Truncation next{present.order + more, present.exponent};
    if (next.order > kLastOrder) continue;
    if (TermCount(dimension, next, kAffordableTerms) <= kAffordableTerms) return next;
  }
  return std::nullopt;
}

}  // namespace polyest
