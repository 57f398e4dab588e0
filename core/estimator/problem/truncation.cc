#include "core/estimator/problem/truncation.h"

#include <cmath>
#include <cstdint>

namespace polyest::internal {
namespace {

constexpr int kFirstOrder = 3;
constexpr int kLastOrder = 9;
constexpr int64_t kAffordableTerms = 500;
// Cubic polynomials seldom follow a model over a wide prior, whatever its dimension. The order
// above them is therefore affordable with as many terms as it has in ten dimensions, when they have
// been tried.
constexpr int kFourthOrder = 4;
constexpr int64_t kAffordableAtFourth = 1001;
// An expansion whose order may still rise must begin well below the maximum.
constexpr int64_t kAffordableAtFirst = 250;

}  // namespace

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
  // A step of one order adds nothing for even or odd functions, so two are tried first.
  for (const int more : {2, 1}) {
    const Truncation next{present.order + more, present.exponent};
    if (next.order > kLastOrder) continue;
    const bool cubic_tried = more == 1 && next.order == kFourthOrder;
    const int64_t affordable = cubic_tried ? kAffordableAtFourth : kAffordableTerms;
    if (TermCount(dimension, next, affordable) <= affordable) return next;
  }
  return std::nullopt;
}

double PointCount(const ExpansionOptions& options, double terms) {
  return std::ceil(options.points_per_term * terms);
}

double PointCountOnPrior(const ExpansionOptions& options, int dimension,
                         const Truncation& truncation, double terms) {
  return options.points == PointSet::kGaussTensor ? std::pow(truncation.order + 1, dimension)
                                                  : PointCount(options, terms);
}

}  // namespace polyest::internal
