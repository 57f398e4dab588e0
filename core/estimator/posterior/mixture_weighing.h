#pragma once

// The weights of the components of the posterior, and the choice of those to continue with.

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
  double left_out = 0;            // largest weight of those dropped for lack of room
};

// Weighs the components and keeps at most `max_kept`, the heaviest. Takes one request per
// component, at least one, all at the same row. Returns an error only on a stop request.
absl::StatusOr<MixtureWeighing> WeighMixture(const std::vector<AssessmentRequest>& requests,
                                             size_t max_kept, const Stop& stop);

// Returns the components, by their indices, that are the same posterior once the parameters of the
// last run are integrated out: those that have the same bounds along the shared germs, and belong
// to the same piece of the posterior (connected_elements.h). `particles` are those of the
// components. Takes requests as WeighMixture does. After a stop request the result means nothing.
std::vector<std::vector<size_t>> GroupsWithoutLastRun(
    const std::vector<AssessmentRequest>& requests, const std::vector<Matrix>& particles,
    const Stop& stop);

// Returns the power of the likelihood of the component that the residuals contradict least.
double CommonPower(const std::vector<AssessmentRequest>& requests);

}  // namespace polyest::internal
