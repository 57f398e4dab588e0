#include "core/estimator/posterior/component_of_estimate.h"

#include <algorithm>
#include <utility>

#include "core/common/types.h"
#include "core/estimator/posterior/diagnosis.h"

namespace polyest::internal {

size_t ComponentOfEstimate(const std::vector<PieceComponent>& components) {
  std::vector<PieceComponent> sorted = components;
  std::ranges::sort(sorted, {}, &PieceComponent::shift);
  double all = 0, more_accurate = 0;
  for (const PieceComponent& one : components) all += one.weight;
  const auto median = std::ranges::find_if(sorted, [&](const PieceComponent& one) {
    return (more_accurate += one.weight) >= 0.5 * all;
  });
  const double largest =
      std::max(kInaccurateShift, median != sorted.end() ? median->shift : kInfinity);
  const auto best = std::ranges::min_element(components, {}, [&](const PieceComponent& one) {
    return std::pair(!(one.shift <= largest), one.cost);
  });
  return static_cast<size_t>(best - components.begin());
}

}  // namespace polyest::internal
