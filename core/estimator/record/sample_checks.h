#pragma once

// Checks measurements against a problem and gives each sample its noise, in time order across
// batches: what is checked here is what the numerics may rely on.

#include <absl/status/statusor.h>

#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/samples.h"

namespace polyest::internal {

// Where the record stands after the rows accepted so far.
struct RecordPosition {
  int64_t rows = 0;
  int run = 0;
  double time_s = 0;
  int64_t rows_in_run = 0;
  bool run_ended = false;  // no more rows of `run`
  Vector largest;          // by channel: max |z| so far, for NoiseModel::relative_to_max
};

// Rows that have passed, and where the record stands after them.
struct CheckedSamples : RowBlock {
  RecordPosition after;
};

// Returns where the record stands after `block`, which follows `position`.
RecordPosition After(const RecordPosition& position, const RowBlock& block);

class SampleChecks {
 public:
  // Checks a record from its beginning. `problem` must outlive the checks.
  explicit SampleChecks(const ResolvedProblem& problem);
  // Checks what follows `position`.
  SampleChecks(const ResolvedProblem& problem, const RecordPosition& position);

  // The whole of `samples`, or INVALID_ARGUMENT that names row (counted from 0 in the samples
  // given), column, value and rule. Changes nothing.
  absl::StatusOr<CheckedSamples> Check(const Samples& samples) const;
  // The rows checked have been stored; the next samples must follow them.
  void Accept(const CheckedSamples& samples) { position_ = samples.after; }
  const RecordPosition& position() const { return position_; }

 private:
  absl::Status CheckColumns(const Samples& samples) const;
  absl::Status CheckTimes(const Samples& samples) const;
  absl::Status CheckValues(const Samples& samples) const;

  const ResolvedProblem& problem_;
  int max_runs_;
  std::vector<std::string> names_;  // the channels, then the streamed inputs
  RecordPosition position_;
};

}  // namespace polyest::internal
