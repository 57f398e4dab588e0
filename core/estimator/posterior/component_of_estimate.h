#pragma once

// Chooses among components that make up one piece of the posterior that which the piece's estimate,
// its minimum of the cost and the curvature there, is of.

#include <cstddef>
#include <vector>

namespace polyest::internal {

struct PieceComponent {
  double cost = 0;    // the least one, comparable among components
  double shift = 0;   // by which its expansion may be off, in standard deviations (findings.shift)
  double weight = 0;  // posterior probability
};

// Returns the index of the component with the least cost. Those whose expansions do not follow the
// model may show a minimum where the model has none: they are left out, unless more than half of
// the weight is theirs. `components` must not be empty.
size_t ComponentOfEstimate(const std::vector<PieceComponent>& components);

}  // namespace polyest::internal
