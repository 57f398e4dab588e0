#pragma once

// Chooses the component whose minimum, and curvature there, are the estimate of a piece of the
// posterior that several components share.

#include <cstddef>
#include <vector>

namespace polyest::internal {

struct PieceComponent {
  double cost = 0;    // the least one, comparable among components
  double shift = 0;   // by which its expansion may be off, in standard deviations (findings.shift)
  double weight = 0;  // posterior probability
};

// Returns the index of the component with the least cost. Those whose expansions do not follow the
// model may show a minimum where the model has none: they are left out, as long as those at least
// as accurate have half of the weight. `components` must not be empty.
size_t ComponentOfEstimate(const std::vector<PieceComponent>& components);

}  // namespace polyest::internal
