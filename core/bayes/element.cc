#include "core/bayes/element.h"

#include <algorithm>

#include "core/common/check.h"

namespace polyest::internal {

bool Element::Contains(const ConstVectorRef& xi) const {
  return std::ranges::all_of(
      bounds_, [&](const Bound& bound) { return bound.normal.dot(xi) <= bound.offset; });
}

std::pair<Element, Element> Element::Divide(const Vector& normal, double offset) const {
  std::pair<Element, Element> parts{*this, *this};
  parts.first.bounds_.push_back({normal, offset});
  parts.second.bounds_.push_back({-normal, -offset});
  return parts;
}

Element Element::WithDimension(Eigen::Index dimension) const {
  Element extended;
  for (const Bound& bound : bounds_) {
    POLYEST_CHECK(bound.normal.size() <= dimension);
    Vector normal = Vector::Zero(dimension);
    normal.head(bound.normal.size()) = bound.normal;
    extended.bounds_.push_back({std::move(normal), bound.offset});
  }
  return extended;
}

}  // namespace polyest::internal
