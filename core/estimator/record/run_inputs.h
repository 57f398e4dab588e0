#pragma once

// The inputs of one run of a record. The knots of a streamed input are its samples in the run's
// rows, of which any may lack one.
//
// Up to a row an input is determined by the knots up to there and a few later ones
// (InputSignal::SettledUpTo), and those up to ResolvedProblem::lead_s later where delays are
// negative. They are read from the store ahead of the row, each row once and no more than needed,
// so what is known at a row is a function of the record alone.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>

#include "core/estimator/problem/resolved_problem.h"
#include "core/model/input_signal.h"
#include "core/propagation/trajectory_ensemble.h"
#include "polyest/samples.h"

namespace polyest::internal {

// Returns the row of the store from which RunInputs may begin, after `rows` rows of the record, so
// that the signals of the present run, which begins at `run_begin`, are the same from `time_s` on:
// so many knots up to that time follow that none before them matters. Returns the store's errors.
absl::StatusOr<int64_t> RowOfFirstKnots(const ResolvedProblem& problem, const SampleStore& store,
                                        int64_t run_begin, int64_t rows, double time_s);

// Returns the time before the present one from which trajectories may need the inputs: the largest
// delay of any input and point, at least 0.
double LargestInputDelay(const EnsembleSpecification& specification);

class RunInputs {
 public:
  // Begins without any knots. The run's first row whose knots are read is `first_row` of the store.
  // `problem` and `store` must outlive the inputs; the store may be null if no input is streamed.
  RunInputs(const ResolvedProblem& problem, const SampleStore* store, int run, int64_t first_row);

  // Reads on until all inputs are settled as far as samples at `time_s` need them, or the run or
  // the store ends. Returns the store's errors.
  absl::Status ReadUpTo(double time_s);
  // Releases the memory of knots that are not needed at or after `time_s`, before which the signals
  // must not be evaluated any more.
  void Forget(double time_s);
  // Whether all inputs are settled as far as samples at `time_s` need them, the time of a row that
  // has been read.
  bool SettledFor(double time_s) const;

  // The signals, one for each of the model's inputs.
  const InputSignals& signals() const { return signals_; }

 private:
  absl::Status ReadNextRows();
  void AppendRow(size_t row);
  absl::Status Finish();

  const ResolvedProblem& problem_;
  const SampleStore* store_;
  int run_;
  InputSignals signals_;
  int64_t next_row_;  // of the store: the first row whose knots have not been appended
  double last_row_s_;
  bool finished_ = false;  // whether the run has no more knots
  RowBlock block_;         // rows read
  size_t next_in_block_ = 0;
};

}  // namespace polyest::internal
