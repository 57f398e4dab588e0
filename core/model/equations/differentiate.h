#pragma once

// Derivatives of expressions as expressions, by the chain rule on the graph.
//
// A piecewise function has the derivative of the piece taken: abs x has sign x, floor and ceil have
// 0, min(a, b) has that of a where a ≤ b, comparisons and logic have 0. Where a function has no
// derivative (√x at 0) the result is not finite.

#include <vector>

#include "core/model/equations/graph.h"

namespace polyest::internal::equations {

// ∂root/∂variable for each root, in the order of the roots for the first variable, then for the
// next: element v·roots + r. kZero where a root does not depend on a variable. If the graph runs
// out of room on the way, graph.exhausted() and the result means nothing. `variables` are nodes.
std::vector<NodeId> Differentiate(Graph& graph, const std::vector<NodeId>& roots,
                                  const std::vector<NodeId>& variables);

}  // namespace polyest::internal::equations
