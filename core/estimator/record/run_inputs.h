#pragma once

// The inputs of one run of a record. The knots of its streamed inputs come with the rows.

#include <limits>

#include "core/estimator/problem/resolved_problem.h"
#include "core/model/input_signal.h"
#include "polyest/samples.h"

namespace polyest::internal {

class RunInputs {
 public:
  // Begins without any knots. `problem` must outlive the inputs.
  RunInputs(const ResolvedProblem& problem, int run);

  // Appends the knots that the block contains, from row `row` on, rows ahead included. Rows whose
  // knots are known already, such as those that were ahead in the block before, are skipped.
  void Append(const RowBlock& block, size_t row);

  // The signals, one for each of the model's inputs.
  const InputSignals& signals() const { return signals_; }

 private:
  const ResolvedProblem& problem_;
  int run_;
  InputSignals signals_;
  double last_knot_s_ = -std::numeric_limits<double>::infinity();
  bool finished_ = false;  // whether the run has no more knots
};

}  // namespace polyest::internal
