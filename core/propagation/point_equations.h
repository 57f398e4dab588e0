#pragma once

// The equations of a model whose code runs elsewhere, such as an FMU's in worker processes, for the
// points of one ensemble.

#include <absl/status/status.h>

#include <string>

#include "polyest/model.h"
#include "polyest/stop.h"

namespace polyest::internal {

// A state-space model whose only parameter is the number of a point of the ensemble, and whose
// outputs are those that the ensemble reads. Rows of one call belong to points that were said to be
// evaluated together. A row without a value is NaN, as in any model; so are all once status() is
// not OK.
class PointEquations : public StateSpaceModel {
 public:
  // Ends waiting for values on this stop request from now on. Must not be called while another
  // thread evaluates.
  virtual void Heed(const Stop& stop) = 0;
  // Returns what has ended all evaluations: the stop request, or that the code is lost.
  virtual absl::Status status() const = 0;
  // Returns why the point had no value when it was last evaluated; empty if it had, or nothing is
  // known.
  virtual std::string FailureOf(int point) const = 0;
};

}  // namespace polyest::internal
