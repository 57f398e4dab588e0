#include "core/bayes/element.h"

#include <algorithm>
#include <cmath>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

// A posterior presses on a bound if at least this share of its particles lies within this many of
// their standard deviations from it. A normal density that is cut off up to about 1.5 standard
// deviations from its peak does.
constexpr double kShareAtCut = 0.03, kNearCut = 0.25;

bool PressOn(const Element::Bound& bound, const ConstMatrixRef& particles) {
  if (particles.rows() == 0) return false;
  const Vector distance = bound.offset - (particles * bound.normal).array();
  const double mean = distance.mean();
  const double deviation = std::sqrt((distance.array() - mean).square().mean());
  const auto near = static_cast<double>((distance.array() < kNearCut * deviation).count());
  return near >= kShareAtCut * static_cast<double>(distance.size());
}

}  // namespace

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

Element Element::Freed(const std::vector<const Element*>& others,
                       const ConstMatrixRef& particles) const {
  Element freed;
  for (const Bound& bound : bounds_) {
    const bool has_neighbour = std::ranges::any_of(others, [&](const Element* other) {
      return std::ranges::any_of(other->bounds_,
                                 [&](const Bound& one) { return one.IsOpposite(bound); });
    });
    if (has_neighbour || !PressOn(bound, particles)) freed.bounds_.push_back(bound);
  }
  return freed;
}

Element Element::AlongGerms(const std::vector<int>& germs) const {
  Element along;
  for (const Bound& bound : bounds_) {
    Vector normal = Vector::Zero(bound.normal.size());
    normal(germs) = bound.normal(germs);
    if (normal == bound.normal) along.bounds_.push_back(bound);
  }
  return along;
}

bool Element::HasBoundsOf(const Element& other) const {
  const auto is_in_other = [&](const Bound& bound) {
    return std::ranges::any_of(other.bounds_, [&](const Bound& one) {
      return one.offset == bound.offset && one.normal == bound.normal;
    });
  };
  return bounds_.size() == other.bounds_.size() && std::ranges::all_of(bounds_, is_in_other);
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
