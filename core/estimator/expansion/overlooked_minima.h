#pragma once

// Minima of the cost that particles of the posterior on an expansion overlook. An expansion over a
// wide region has errors of its own, which can raise the cost at a narrow minimum until hardly a
// particle is there. Before a region contracts, the model itself is run at such minima.

#include <absl/status/statusor.h>

#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

struct ConfirmedMinima {
  Matrix points;                // one row each, local coordinates; usually none
  int64_t propagated_rows = 0;  // by the model, to confirm them
  double error = 0;  // largest difference between model and expansion in a cost at these minima
};

// Returns the local minima of `cost`, the cost on `expansion`, that lie outside the region of the
// particles (germ coordinates) and that the model confirms: there its own cost is at most 12 above
// that at the lowest minimum. They are sought from the best collocation points and from the best of
// the request's guesses outside. The model runs only if there are minima outside, and if the
// request's allowance lets the record be propagated again; none is confirmed without. Returns an
// error on a stop request or when the store cannot be read.
absl::StatusOr<ConfirmedMinima> OverlookedMinima(const RegionalExpansion& expansion,
                                                 const Cost& cost, const Matrix& particles,
                                                 const ReexpansionRequest& request,
                                                 const Stop& stop);

// Returns points (count × n, germ coordinates) of the normal distribution around a minimum (local
// coordinates) that the curvature of the cost there means; the minimum itself where the cost is not
// finite or has no such curvature. They depend on the arguments alone.
Matrix DrawsAround(const Cost& cost, const Vector& minimum, Eigen::Index count, uint64_t seed);

}  // namespace polyest::internal
