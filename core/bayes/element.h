#pragma once

// An element of the germ's space, as in multi-element polynomial chaos: a part of Ω that has an
// expansion of its own. It is bounded by hyperplanes, each of which divided an element into two.
// The elements that divisions leave cover Ω and have only hyperplanes in common, so that the
// posterior's integral is the sum of theirs. Where the parameter of an ended run divided them and
// has been integrated out, they overlap, and the posterior's density is the sum of theirs, too.
//
// Source: Wan & Karniadakis, Journal of Computational Physics 209 (2005), 617.

#include <utility>
#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

class Element {
 public:
  // The half-space normalᵀξ ≤ offset.
  struct Bound {
    Vector normal;
    double offset = 0;

    // Whether the other half-space is what this one leaves of the space.
    bool IsOpposite(const Bound& other) const {
      return normal.size() == other.normal.size() && offset == -other.offset &&
             normal == -other.normal;
    }

    // Writes to or reads from a cereal archive. The size of what is read is not checked.
    template <class Archive>
    void serialize(Archive& archive) {
      archive(normal, offset);
    }
  };

  // All of Ω.
  Element() = default;
  explicit Element(std::vector<Bound> bounds) : bounds_(std::move(bounds)) {}

  const std::vector<Bound>& bounds() const { return bounds_; }
  // Whether the point of Ω belongs to the element.
  bool Contains(const ConstVectorRef& xi) const;
  // Returns the parts with normalᵀξ ≤ offset and with normalᵀξ ≥ offset.
  std::pair<Element, Element> Divide(const Vector& normal, double offset) const;
  // Returns the element without the bounds beyond which none of the others lies and on which the
  // particles (a row each) press. It then has the place of those that are gone, and still only
  // hyperplanes in common with the others.
  Element Freed(const std::vector<const Element*>& others, const ConstMatrixRef& particles) const;
  // Returns the element without the bounds that depend on any germ but the given ones.
  Element AlongGerms(const std::vector<int>& germs) const;
  // Whether both have the same bounds, in any order.
  bool HasBoundsOf(const Element& other) const;
  // Returns the same part of a space with more dimensions, unbounded in the new ones.
  Element WithDimension(Eigen::Index dimension) const;

 private:
  std::vector<Bound> bounds_;
};

}  // namespace polyest::internal
