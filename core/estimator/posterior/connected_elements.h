#pragma once

// Which elements of a mixture belong to the same piece of the posterior. Two elements with a common
// bound are connected if the cost somewhere on it is less than 8 above the higher of their least
// costs: the density there is more than e^−8 of that peak. Elements that a parameter of a run
// divided overlap once the run has ended and the parameter is integrated out; they are connected if
// one of them has so low a cost where the other has its least. A piece consists of elements that
// are connected with one another, directly or through others.

#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/minimizer.h"
#include "core/estimator/expansion/expansion_design.h"

namespace polyest::internal {

// What is compared of one element.
struct ElementCost {
  const ExpansionDesign* design = nullptr;
  const Cost* cost = nullptr;
  double height = 0;  // c_k, which makes the costs comparable (mixture_share.h)
  Minimum minimum;    // of the cost, local coordinates
};

// Returns the index of each element's piece; pieces are numbered in the order of their first
// elements.
std::vector<size_t> ConnectedPieces(const std::vector<ElementCost>& elements);

}  // namespace polyest::internal
