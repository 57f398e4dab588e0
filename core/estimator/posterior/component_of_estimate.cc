#include "core/estimator/posterior/component_of_estimate.h"

#include <algorithm>
#include <utility>

#include "core/estimator/posterior/diagnosis.h"

namespace polyest::internal {

size_t ComponentOfEstimate(const std::vector<PieceComponent>& components) {
  const auto is_accurate = [](const PieceComponent& one) { return one.shift <= kInaccurateShift; };
  double accurate = 0, all = 0;
  for (const PieceComponent& one : components) {
    all += one.weight;
    if (is_accurate(one)) accurate += one.weight;
  }
  const bool leaves_out = accurate >= 0.5 * all;
  const auto best = std::ranges::min_element(components, {}, [&](const PieceComponent& one) {
    return std::pair(leaves_out && !is_accurate(one), one.cost);
  });
  return static_cast<size_t>(best - components.begin());
}

}  // namespace polyest::internal
