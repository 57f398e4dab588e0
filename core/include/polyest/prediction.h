#pragma once

// What the posterior says of the signals: the model's outputs over time for the parameters as
// estimated, with their uncertainty, beside what was measured.
//
// Trajectories of the model itself, not of the expansion, are computed for draws θ_d of the
// posterior. The prediction of an output y at a time is the distribution of the y(θ_d); that of a
// new sample has the channel's noise added,
//   p(z) = (1/D) Σ_d k((z − y(θ_d))/s_d)/s_d,
// where k is the standard normal density, or the t density with 4 degrees of freedom for a channel
// with OutlierHandling::kStudentT, and s_d the noise's standard deviation; where its size was
// estimated from ν degrees of freedom, s_d² is a draw of its scaled inverse χ² distribution.
//
// With LikelihoodForm::kPredictionError a filter runs at each θ_d in place of a trajectory. It
// predicts each row from the samples before it, and y(θ_d) is a normal distribution; times after
// the last row are forecasts. Student's t noise is then a normal one whose variance is drawn for
// each θ_d. Estimator::CurrentPrediction computes it.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "polyest/diagnostic.h"
#include "polyest/samples.h"
#include "polyest/types.h"

namespace polyest {

// Limits past which options are INVALID_ARGUMENT.
inline constexpr int kMaxPredictionDraws = 10'000;        // PredictionOptions::draws
inline constexpr int64_t kMaxPredictionRows = 1'000'000;  // max_rows, and the number of times
inline constexpr int kMaxPredictionLags = 10'000;         // PredictionOptions::lags
// The most numbers in an answer: rows × outputs × numbers for each; past it RESOURCE_EXHAUSTED.
inline constexpr int64_t kMaxPredictedValues = 10'000'000;
// The most values that smoothing keeps: draws × outputs × times; past it RESOURCE_EXHAUSTED.
inline constexpr int64_t kMaxSmoothedValues = 10'000'000;

// What to compute.
struct PredictionOptions {
  // Names of the model's outputs and of parameters that drift, which are predicted over time as
  // outputs are; empty: the measured outputs and what drifts.
  std::vector<std::string> outputs;
  std::vector<double> probabilities = {0.025, 0.5, 0.975};  // of the quantiles, in (0, 1)
  int draws = 400;          // D: trajectories, each at a draw of the posterior, ≥ 2
  int64_t max_rows = 2000;  // ≥ 1; of a longer record evenly spaced rows are returned
  // Times to predict at instead of the record's rows: in time order, in runs of the record, and
  // with streamed inputs not after the run's last row.
  std::vector<SampleRow> times;
  // If > 0, `max_rows` evenly spaced times after the last row of the record, up to so many seconds
  // later, instead of the record's rows; ≥ 0. Not with `times`, nor where an input is streamed,
  // since nobody knows it yet.
  double forecast_s = 0;
  // How far ahead filters predict, s, ≥ 0; 0 for output errors. The record is divided into windows:
  // one begins after the last row of the one before, and ends with the last row within `horizon_s`
  // of that. No sample is used within its own window. 0: each row is predicted from all rows before
  // it.
  double horizon_s = 0;
  // Whether filters tell the outputs at each time from all samples of its run (smoothing). The
  // samples at that time are among them, so nothing is said of new samples, and nothing is scored.
  // Not with `horizon_s`, nor for output errors, whose predictions are of all samples anyway.
  bool smoothed = false;
  int lags = 50;  // of the residuals' autocorrelation, ≥ 0
  // The first row of the record that is scored, ≥ 0; those before it serve the filters.
  int64_t first_scored_row = 0;
  // Another record of the same problem to predict, whose samples did not enter the estimate. Its
  // runs' own parameters are drawn from the prior.
  std::optional<Samples> record;
  // Whether the runs of `record` are those of the estimate's record, of which it may have more
  // rows: parameters that runs have of their own are then as they have been estimated.
  bool same_runs = false;
};

// The agreement of a prediction with the samples of one channel, over all rows of the record from
// `first_scored_row` on, whether returned or not.
struct PredictionScore {
  int64_t samples = 0;  // number of them
  // Mean of log p(z), with z in the output's unit: the higher, the better. Differences of two
  // models' log scores on a record that neither has seen compare the models.
  double log_score = 0;
  double coverage95 = 0;        // fraction of the samples within the central 95 % of p
  double root_mean_square = 0;  // of the residuals, in the output's unit
  // Correlation of the standardized residuals of samples 1, 2, … `lags` apart in the same run.
  Vector autocorrelation;
};

// A sudden change of a parameter that drifts, which its random walk does not explain: if a step of
// the parameter at this time is allowed beside the walk, the log likelihood rises by score²/2.
// Source: P. de Jong, J. Penzer, "Diagnosing shocks in time series", J. Am. Stat. Assoc. 93 (1998).
struct AbruptChange {
  SampleRow at;      // the time, of those returned, at which the new value is there
  double score = 0;  // its sign is that of the step; ~ N(0, 1) at each time if the parameter walks
  double limit = 0;  // which |score| of a walk exceeds in less than 1 % of records, > 0
};

// One output over time, in its unit. Vectors have one element for each time.
struct PredictedOutput {
  std::string output;  // its name
  std::string unit;    // "1" for a plain number; empty: the equations give none
  Vector mean;         // of the output
  Vector std_dev;      // of the output
  Matrix quantiles;    // of the output, times × probabilities
  // The rest is empty for outputs that are not measured, and also, except for `measured` and
  // `residual`, if smoothed or while noise of unknown size has not been estimated.
  Vector sample_std_dev;         // of a new sample
  Matrix sample_quantiles;       // of a new sample, times × probabilities
  Vector measured;               // the samples; NaN where there is none
  Vector residual;               // measured − mean; NaN where there is no sample
  Vector standardized_residual;  // ÷ sample_std_dev; NaN where there is no sample, 0 where a
                                 // sample has no noise, such as a 0 of relative noise
  PredictionScore score;         // over the record
  // The most certain abrupt change of a parameter that drifts, if smoothed and if its score is
  // beyond the limit; else empty.
  std::optional<AbruptChange> abrupt_change;
};

// The prediction.
struct Prediction {
  std::vector<SampleRow> rows;           // the times, as asked for
  std::vector<PredictedOutput> outputs;  // as asked for
  int draws = 0;                         // trajectories, with those that failed
  int failed = 0;                        // trajectories that could not be integrated to the end
  int64_t record_rows = 0;               // rows of the record predicted
  // Those of an estimate from the same samples.
  std::vector<Diagnostic> diagnostics;
};

}  // namespace polyest
