#include "core/estimator/posterior/connected_elements.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/estimator/expansion/search_domain.h"
#include "core/estimator/posterior/cost_slice.h"
#include "core/estimator/posterior/posterior_pieces.h"

namespace polyest::internal {
namespace {

// Distance from the bound at which the cost is taken, as a fraction of the element's extent: on the
// bound itself rounding decides whether a point belongs to the element.
constexpr double kOffWall = 1e-9;

// Returns the least cost of the element at its bound, +∞ if the expansion's box does not reach it.
double LeastAt(const Element::Bound& bound, const ElementCost& element) {
  const Region& region = element.design->region;
  const Vector normal = region.axes().transpose() * bound.normal;
  const MinimizationProblem search = SearchOf(*element.cost, *element.design);
  const double reach = normal.cwiseAbs().dot(search.upper - search.lower);
  const double offset = bound.offset - bound.normal.dot(region.centre()) - kOffWall * reach;
  const std::optional<Minimum> least =
      CostSlice(search, normal).Minimize(offset, {element.minimum.point}, Stop());
  return least && std::isfinite(least->value) ? least->value + element.height : kInfinity;
}

// Returns the cost of the element where the other one has its least, +∞ if the element does not
// have that point or the expansion's box does not reach it.
double CostWhereLeast(const ElementCost& other, const ElementCost& element) {
  const Vector xi = other.design->region.ToGerm(other.minimum.point);
  const Vector eta = element.design->region.ToLocal(xi);
  Vector lower, upper;
  SamplingBox(*element.design, lower, upper);
  const bool reached = (eta.array() >= lower.array() && eta.array() <= upper.array()).all();
  if (!reached || !element.design->element.Contains(xi)) return kInfinity;
  return element.cost->Evaluate(eta).total + element.height;
}

bool AreConnected(const ElementCost& a, const ElementCost& b) {
  const double peak = std::max(a.minimum.value + a.height, b.minimum.value + b.height);
  if (std::min(CostWhereLeast(a, b), CostWhereLeast(b, a)) < peak + kMinWall) return true;
  for (const Element::Bound& bound : a.design->element.bounds()) {
    for (const Element::Bound& other : b.design->element.bounds()) {
      if (!bound.IsOpposite(other)) continue;
      // Both sides must reach the bound, each at its own place if the expansions differ a little.
      return LeastAt(bound, a) < peak + kMinWall && LeastAt(other, b) < peak + kMinWall;
    }
  }
  return false;
}

}  // namespace

std::vector<size_t> ConnectedPieces(const std::vector<ElementCost>& elements) {
  std::vector<size_t> pieces(elements.size());
  for (size_t i = 0; i < elements.size(); ++i) {
    pieces[i] = i;
    for (size_t k = 0; k < i; ++k) {
      if (pieces[k] == pieces[i] || !AreConnected(elements[k], elements[i])) continue;
      // Copies, because `replace` reads what it compares with after it has overwritten elements.
      const size_t kept = std::min(pieces[k], pieces[i]), joined = std::max(pieces[k], pieces[i]);
      std::ranges::replace(pieces, joined, kept);
    }
  }
  std::vector<size_t> numbers = pieces;
  std::ranges::sort(numbers);
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  for (size_t& piece : pieces) {
    piece = static_cast<size_t>(std::ranges::lower_bound(numbers, piece) - numbers.begin());
  }
  return pieces;
}

}  // namespace polyest::internal
