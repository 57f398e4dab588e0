#pragma once

// Predicts the outputs over a record from draws of the posterior (polyest/prediction.h).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <vector>

#include "core/bayes/predictive_density.h"
#include "core/estimator/posterior/assessment.h"
#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/record_trajectories.h"
#include "polyest/prediction.h"
#include "polyest/samples.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns InvalidArgument or ResourceExhausted that names the field, the value and the rule if the
// options are invalid. `rows`: of the record to predict.
absl::Status Validate(const PredictionOptions& options, const ResolvedProblem& problem,
                      int64_t rows);

// Returns a refusal of measurements as one of the record to predict: its path begins with "record"
// in place of "measurements".
absl::Status OfRecord(const absl::Status& status);

// The noise of a new sample of one measured output, as the estimate has it.
struct PredictedNoise {
  double scale = 1;  // σ in units of NoiseModel::StandardDeviation; 0: not known yet
  // From how many the scale was estimated; 0 where it is known.
  double degrees_of_freedom = 0;
  double largest = 0;  // max |z| of the samples so far, in the output's unit
};

// Returns the noise of each measured output. Where residuals contradict a noise of known size, it
// is as large as they are, as it is for the estimate.
std::vector<PredictedNoise> NoiseOf(const Assessed& assessed, const RecordSummary& record,
                                    const LearnedNoise& learned, const ResolvedProblem& problem);

// Returns `count` equally weighted draws of the uncertain parameters (StratifiedDraws), count × n.
Matrix EquallyWeightedThetas(const PosteriorDraws& draws, const Prior& prior, int count);

// The rows to predict, and the values to predict them with.
struct PredictionSubject {
  const ResolvedProblem* problem = nullptr;
  const SampleStore* store = nullptr;
  int64_t rows = 0;                   // the first rows of the store, ≥ 1
  Matrix thetas;                      // draws × n, equally weighted
  std::vector<PredictedNoise> noise;  // by measured output
};

// Returns values of the uncertain parameters of `other`, the same problem for other runs: `thetas`
// (draws × parameters of `own`) where the parameter is shared by all runs, and draws of the prior
// where each run has its own. If the runs are the same, those of `own` keep their parameters.
Matrix ThetasOfOtherRuns(const ResolvedProblem& own, const Matrix& thetas,
                         const ResolvedProblem& other, bool same_runs);

// Computes the prediction, without diagnostics. `options` must be valid. FailedPrecondition if too
// few trajectories can be integrated.
absl::StatusOr<Prediction> Predict(const PredictionSubject& subject,
                                   const PredictionOptions& options, int threads, const Stop& stop);

}  // namespace polyest::internal
