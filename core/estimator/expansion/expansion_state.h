#pragma once

// An expansion between two rows as plain data, from which RegionalExpansion::FromState makes one
// that goes on to the same bits. What follows from the rest to the bit is left out: the basis, the
// trajectories' parameters, the factors of the collocation matrix.

#include <optional>
#include <vector>

#include "core/estimator/expansion/regional_expansion.h"
#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

// Fields as of ExpansionDesign and its region.
struct DesignState {
  Truncation truncation;
  bool whole_prior = true;
  Vector centre;
  Matrix axes;
  Matrix points, check_points;
  Vector check_costs;
  Vector reference, lower, upper;
};

DesignState StateOf(const ExpansionDesign& design);
// DATA_LOSS when it cannot be a design for the problem.
absl::StatusOr<ExpansionDesign> DesignOf(const ResolvedProblem& problem, DesignState state);

struct ExpansionState {
  DesignState design;
  LearnedNoise noise;
  AbsorbedRows absorbed{0, 0, 0};
  std::vector<int> kept;
  std::vector<FailedTrajectory> failures;
  // In the middle of a run; nothing where a new one begins.
  int run = 0;
  std::optional<EnsembleState> ensemble;
  std::vector<PreviousSample> previous;  // by channel
};

}  // namespace polyest::internal
