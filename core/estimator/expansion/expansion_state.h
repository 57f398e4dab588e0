#pragma once

// The state of an expansion between two rows as plain data. RegionalExpansion::FromState makes an
// expansion from it that continues bit for bit. The state omits what can be recomputed bit for bit
// from the rest: the basis, the parameters of the trajectories, and the factors of the collocation
// matrix.

#include <vector>

#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// The fields are those of ExpansionDesign and its region.
struct DesignState {
  Truncation truncation;
  bool whole_prior = true;
  bool in_tails = false;
  Vector centre;
  Matrix axes;
  Matrix points, check_points;
  Vector check_costs;
  bool checks_are_draws = false;
  Vector reference, lower, upper;
  std::vector<Element::Bound> element;
};

DesignState StateOf(const ExpansionDesign& design);
// Returns the design, or DataLoss when it cannot belong to the problem.
absl::StatusOr<ExpansionDesign> DesignOf(const ResolvedProblem& problem, DesignState state);

struct ExpansionState {
  DesignState design;
  LearnedNoise noise;
  AbsorbedRows absorbed;
  TrajectoryState trajectories;
};

}  // namespace polyest::internal
