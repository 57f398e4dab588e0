#pragma once

// Collects what Predict returns (prediction.h), instant by instant.

#include <absl/status/status.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/estimator/record/record_trajectories.h"
#include "core/estimator/studies/prediction.h"

namespace polyest::internal {

// The draws that must be left at every instant.
inline constexpr Eigen::Index kMinDraws = 2;

// Selects the rows of an answer: at most `max_count` of `rows`, evenly spaced.
class RowSelection {
 public:
  RowSelection(int64_t rows, int64_t max_count) : rows_(rows), count_(std::min(rows, max_count)) {}
  int64_t size() const { return count_; }
  // Returns the place of a row in the answer; −1 if it is left out.
  int64_t PlaceOf(int64_t row) const {
    const int64_t place = row * count_ / rows_;
    return row == 0 || place != (row - 1) * count_ / rows_ ? place : -1;
  }

 private:
  int64_t rows_, count_;
};

class OutputPrediction;

class PredictionBuilder {
 public:
  // `columns`: the outputs, columns of the model's. `subject` and `options` must outlive it.
  PredictionBuilder(const PredictionSubject& subject, const PredictionOptions& options,
                    const std::vector<int>& columns);
  ~PredictionBuilder();

  // Whether a row of the record is among the times returned.
  bool Returns(int64_t row) const { return by_rows_ && selection_.PlaceOf(row) >= 0; }
  // Takes what all draws predict at the next instant, as RecordTrajectories::Visit. Returns
  // FailedPrecondition if fewer than half of them can be integrated to there.
  absl::Status Add(const TrajectoryInstant& instant, const ConstMatrixRef& values,
                   const ConstMatrixRef& deviations);
  // Returns the prediction, in which `failed` draws could not be integrated to the end.
  Prediction Take(int failed);

 private:
  bool by_rows_;
  RowSelection selection_;
  std::vector<OutputPrediction> outputs_;
  Prediction prediction_;
};

}  // namespace polyest::internal
