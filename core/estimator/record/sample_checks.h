#pragma once

// Checks measurements against a problem, across batches and in time order, and assigns each sample
// its noise. The numerical code relies on these checks.

#include <absl/status/statusor.h>

#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/settled_rows.h"
#include "polyest/samples.h"

namespace polyest::internal {

// The position in the record after the rows accepted so far.
struct RecordPosition {
  int64_t rows = 0;
  int run = 0;
  double time_s = 0;
  int64_t rows_in_run = 0;
  bool run_ended = false;       // whether no more rows of `run` follow
  Vector largest;               // per channel: max |z| so far, for NoiseModel::relative_to_max
  std::vector<KnotRows> knots;  // of `run`, by streamed input
  std::vector<double> gate;     // RowBlock::gate
};

// Rows that have passed the checks, and the position after them.
struct CheckedSamples : RowBlock {
  RecordPosition after;
  int64_t left_out = 0;  // rows for which Problem::use_when does not hold
};

// Returns where the record stands after `block`, which follows `position`.
RecordPosition After(const RecordPosition& position, const RowBlock& block);

class SampleChecks {
 public:
  // Checks a record from its beginning. `problem` must outlive the checks.
  explicit SampleChecks(const ResolvedProblem& problem);
  // Checks what follows `position`.
  SampleChecks(const ResolvedProblem& problem, const RecordPosition& position);

  // Returns all rows of `samples`, of which any column may be missing in any row, or
  // InvalidArgument that names the row (counted from 0 in `samples`), the column, the value and the
  // rule. Changes nothing.
  absl::StatusOr<CheckedSamples> Check(const Samples& samples) const;
  // Checks what does not depend on the rows around: rows that pass, in any order, also pass Check
  // once they are in time order, between whatever others. Judges a sample by the least noise that
  // it may have there, and as if Problem::use_when used it. Errors are those of Check.
  absl::Status CheckInAnyOrder(const Samples& samples) const;
  // Records that the checked rows have been stored. The next samples must follow them.
  void Accept(const CheckedSamples& samples) { position_ = samples.after; }
  const RecordPosition& position() const { return position_; }
  // Returns the columns that samples may have: measured outputs, streamed inputs, then what only
  // Problem::use_when names.
  const std::vector<std::string>& names() const { return names_; }

 private:
  absl::Status CheckColumns(const Samples& samples) const;
  absl::Status CheckTimes(const Samples& samples) const;
  absl::Status CheckPlace(const Samples& samples, size_t row) const;
  absl::Status CheckValues(const Samples& samples) const;
  absl::Status CheckSizes(const Samples& samples, const SampleColumn& column) const;
  std::vector<bool> UsedRows(const Samples& samples, std::vector<double>& gate) const;
  absl::Status PlaceColumn(const Samples& samples, const SampleColumn& column,
                           const std::vector<bool>& used, double& largest,
                           CheckedSamples& checked) const;

  const ResolvedProblem& problem_;
  int max_runs_;
  size_t width_ = 0;                // of the values: channels and streamed inputs
  std::vector<std::string> names_;  // of these, then of the other columns in use_when
  RecordPosition position_;
};

}  // namespace polyest::internal
