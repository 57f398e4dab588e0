#pragma once

// Combines the components of the posterior: their weights, the choice of those to continue with,
// and the estimate of the mixture.

#include <absl/status/statusor.h>

#include <vector>

#include "core/estimator/posterior/assessment.h"
#include "polyest/stop.h"

namespace polyest::internal {

// A component of smaller weight is dropped, because it no longer affects any result.
inline constexpr double kMinWeight = 1e-6;

struct MixtureWeighing {
  std::vector<size_t> kept;       // indices of the requests, ascending; at least one
  std::vector<double> weights;    // weights of those kept, Σ = 1
  std::vector<Matrix> particles;  // of those kept, equally weighted, germ coordinates
  double left_out = 0;            // share of those dropped for lack of room
};

// Weighs the components and keeps at most the `most` heaviest. Takes one request per component, at
// least one, all at the same row. Returns an error only on a stop request.
absl::StatusOr<MixtureWeighing> WeighMixture(const std::vector<AssessmentRequest>& requests,
                                             size_t most, const Stop& stop);

struct AssessedMixture {
  Assessed whole;                    // for a single component, its own assessment
  std::vector<Assessed> components;  // heaviest first; empty for a single component
  std::vector<size_t> order;         // their indices among the requests; {0} for a single one
};

// Assesses the mixture. Takes one request per component, at least one, If a stop has left the
// components at different rows, their last weights are used. `left_out` is that of the last
// weighing. Returns an error only on a stop request.
absl::StatusOr<AssessedMixture> AssessMixture(std::vector<AssessmentRequest> requests,
                                              double left_out, const Stop& stop);

}  // namespace polyest::internal
