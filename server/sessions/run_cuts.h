#pragma once

// Lets a session go on after its model could not be computed: the run ends for the estimator before
// the row at which too few trajectories could be integrated, and rows of the next run are used
// again. Where a run is cut is a function of the rows, because the numerics are.

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "polyest/diagnostic.h"
#include "polyest/samples.h"

namespace polyest::internal {

// For one thread at a time.
class RunCuts {
 public:
  bool empty() const { return cuts_.empty(); }
  // Leaves out the rows of `row`'s run from this row on, for this reason. The first row of a record
  // cannot be left out without all others, because a record begins with run 0.
  void Add(const SampleRow& row, bool first_of_record, absl::string_view reason);

  // Returns the samples without the rows left out.
  Samples Keep(Samples samples) const;
  // Returns POINTS_FAILED, saying what is left out and why. Requires that something is.
  Diagnostic Describe() const;

  // Returns the state of an estimator with the cuts before it; the state alone if there are none.
  std::string Prepend(std::string state) const;
  // Takes the cuts from the beginning of such a state, which is then the estimator's alone.
  // DATA_LOSS if they cannot be read.
  static absl::StatusOr<RunCuts> Split(std::string& state);

 private:
  struct Cut {
    double from_s = 0;
    std::string reason;
  };

  bool LeavesOut(int run, double time_s) const;

  std::map<int, Cut> cuts_;  // by run
  bool everything_ = false;  // whether no row can be used
};

}  // namespace polyest::internal
