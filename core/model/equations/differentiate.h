#pragma once

// Symbolic derivatives: the chain rule applied to a graph of expressions.
//
// A piecewise function has the derivative of the piece that is taken: sign x for abs x, 0 for floor
// and ceil, the derivative of a for min(a, b) where a ≤ b, 0 for comparisons and logic. Where a
// function has no derivative (√x at 0) the result is not finite.

#include <vector>

#include "core/model/equations/graph.h"

namespace polyest::internal::equations {

// Returns ∂root/∂variable for nodes `variables`: element v·roots + r is the derivative of root r
// with respect to variable v, kZero if the root does not depend on it. If the graph runs out of
// room, graph.exhausted() becomes true and the result is meaningless.
std::vector<NodeId> Differentiate(Graph& graph, const std::vector<NodeId>& roots,
                                  const std::vector<NodeId>& variables);

}  // namespace polyest::internal::equations
