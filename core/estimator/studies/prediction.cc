#include "core/estimator/studies/prediction.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/bayes/population_cost.h"
#include "core/bayes/weighted_samples.h"
#include "core/chaos/collocation_points.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/expansion/prior_expansion.h"
#include "core/estimator/problem/settable_quantities.h"
#include "core/estimator/studies/prediction_builder.h"
#include "core/estimator/studies/study_options.h"
#include "polyest/posterior.h"

namespace polyest::internal {
namespace {

// Returns the number of numbers that each output has at each time.
int64_t NumbersPerTime(const PredictionOptions& options) {
  constexpr int64_t kPlain = 6;  // mean, standard deviations, sample, residuals
  return kPlain + 2 * std::ssize(options.probabilities);
}

absl::Status ValidateForecast(const PredictionOptions& options, const ResolvedProblem& problem) {
  const double forecast_s = options.forecast_s;
  if (!std::isfinite(forecast_s) || forecast_s < 0) {
    return InvalidField("forecast_s", absl::StrFormat("%g must be a finite time ≥ 0", forecast_s));
  }
  if (forecast_s == 0) return absl::OkStatus();
  if (!options.times.empty()) {
    return InvalidField("forecast_s", "cannot be combined with times of their own");
  }
  if (problem.streamed_inputs().empty()) return absl::OkStatus();
  return InvalidField("forecast_s",
                      absl::StrFormat("%g needs inputs that are known in advance, and one is "
                                      "streamed",
                                      forecast_s));
}

// Returns the number of times of which the prediction tells, for a record of so many rows.
int64_t CountTimes(const PredictionOptions& options, int64_t rows) {
  if (options.forecast_s > 0) return options.max_rows;
  return options.times.empty() ? std::min(rows, options.max_rows) : std::ssize(options.times);
}

// Refuses a prediction of too many outputs, counted at all times.
absl::Status LimitNumbers(const PredictionOptions& options, int64_t outputs) {
  const int64_t numbers = outputs * NumbersPerTime(options);
  if (numbers > kMaxPredictedValues) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("the prediction would have %d numbers, the limit is %d; ask for fewer "
                        "rows, outputs or probabilities",
                        numbers, kMaxPredictedValues));
  }
  const int64_t smoothed = options.smoothed ? outputs * options.draws : 0;
  if (smoothed <= kMaxSmoothedValues) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrFormat("smoothing would keep %d values, one for each draw, output and time, the "
                      "limit is %d; ask for fewer rows, outputs or draws",
                      smoothed, kMaxSmoothedValues));
}

// Returns the times after the record's last row to predict at.
absl::StatusOr<std::vector<SampleRow>> ForecastTimes(const PredictionSubject& subject,
                                                     const PredictionOptions& options) {
  std::vector<SampleRow> times;
  if (subject.rows == 0) return times;
  RowBlock last;
  POLYEST_RETURN_IF_ERROR(subject.store->Read(subject.rows - 1, 1, last));
  const SampleRow& row = last.rows.front();
  const double step_s = options.forecast_s / static_cast<double>(options.max_rows);
  for (int64_t i = 1; i <= options.max_rows; ++i) {
    const double time_s = row.time_s + static_cast<double>(i) * step_s;
    // A step may be below the resolution of the time.
    if (time_s > (times.empty() ? row.time_s : times.back().time_s)) {
      times.push_back({row.run, time_s});
    }
  }
  if (!times.empty()) return times;
  return InvalidField("forecast_s",
                      absl::StrFormat("%g is too small beside the time of the last row, %g s",
                                      options.forecast_s, row.time_s));
}

}  // namespace

absl::Status Validate(const PredictionOptions& options, const ResolvedProblem& problem,
                      int64_t rows) {
  POLYEST_ASSIGN_OR_RETURN(const std::vector<int> columns, ChooseOutputs(problem, options.outputs));
  POLYEST_RETURN_IF_ERROR(CheckProbabilities(options.probabilities));
  POLYEST_RETURN_IF_ERROR(CheckRange("draws", options.draws, kMinDraws, kMaxPredictionDraws));
  POLYEST_RETURN_IF_ERROR(CheckRange("max_rows", options.max_rows, 1, kMaxPredictionRows));
  if (!std::isfinite(options.horizon_s) || options.horizon_s < 0) {
    return InvalidField("horizon_s",
                        absl::StrFormat("%g must be a finite time ≥ 0", options.horizon_s));
  }
  if (options.horizon_s > 0 && !problem.uses_filters()) {
    return InvalidField("horizon_s",
                        absl::StrFormat("%g needs likelihood PREDICTION_ERROR; a perfect model is "
                                        "predicted from its parameters alone, at any time",
                                        options.horizon_s));
  }
  POLYEST_RETURN_IF_ERROR(ValidateForecast(options, problem));
  if (options.smoothed && (options.horizon_s > 0 || !problem.uses_filters())) {
    return InvalidField("smoothed", options.horizon_s > 0
                                        ? "true leaves no sample out, unlike horizon_s"
                                        : "true needs likelihood PREDICTION_ERROR; a perfect model "
                                          "is predicted from all samples anyway");
  }
  if (options.same_runs && !options.record) {
    return InvalidField("same_runs", "true needs a record, whose runs it is about");
  }
  POLYEST_RETURN_IF_ERROR(CheckRange("lags", options.lags, 0, kMaxPredictionLags));
  POLYEST_RETURN_IF_ERROR(CheckRange("first_scored_row", options.first_scored_row, 0,
                                     std::numeric_limits<int64_t>::max()));
  POLYEST_RETURN_IF_ERROR(CheckRange("times", std::ssize(options.times), 0, kMaxPredictionRows));
  return LimitNumbers(options, CountTimes(options, rows) * std::ssize(columns));
}

namespace {

// Draws the runs' parameters that share a population from it: g = μ + s ξ, with the germs in the
// given order.
void DrawFromPopulation(const ResolvedProblem& problem, const Matrix& xis,
                        const std::vector<Eigen::Index>& order, Matrix& thetas) {
  const ResolvedProblem::Population population = *problem.population();
  const Prior& prior = problem.prior();
  for (Eigen::Index d = 0; d < thetas.rows(); ++d) {
    const RunScore among =
        PopulationOfGerms(prior.ScoreOf(population.mean, thetas(d, population.mean)),
                          prior.ScoreOf(population.spread, thetas(d, population.spread)));
    for (int run = problem.first_run(); run < problem.runs(); ++run) {
      const int own = problem.OwnParameters(run)[static_cast<size_t>(population.own)];
      const double xi = xis(order[static_cast<size_t>(d)], own);
      thetas(d, own) = prior.OfScore(own, among.mean + std::sqrt(among.variance) * xi);
    }
  }
}

// Sets the parameters of the runs of `other` that `own` has estimated.
void TakeOwnRuns(const ResolvedProblem& own, const Matrix& thetas, const ResolvedProblem& other,
                 Matrix& result) {
  for (int run = 0; run < std::min(own.runs(), other.runs()); ++run) {
    const bool ended = run < own.first_run();
    const std::vector<int> from = own.OwnParameters(ended ? own.first_run() : run);
    const Matrix of_run = ended ? own.ThetasOfEndedRun(thetas, run) : thetas;
    result(Eigen::all, other.OwnParameters(run)) = of_run(Eigen::all, from);
  }
}

}  // namespace

Matrix ThetasOfOtherRuns(const ResolvedProblem& own, const Matrix& thetas,
                         const ResolvedProblem& other, bool same_runs) {
  const Prior& prior = other.prior();
  const auto draws = static_cast<int>(thetas.rows());
  // The points of Halton's sequence are distributed as the prior.
  const Matrix xis = HaltonDraws(prior.germs(), draws);
  Matrix result(draws, prior.dimension());
  const std::vector<Eigen::Index> order = ScatteredOrder(draws);
  for (Eigen::Index d = 0; d < draws; ++d) {
    result.row(d) = prior.ToParameters(xis.row(order[static_cast<size_t>(d)]).transpose());
  }
  const std::vector<UncertainParameter>& given = own.problem().uncertain;
  for (size_t i = 0; i < given.size(); ++i) {
    // The problem's own parameters come first, those of later runs behind them.
    const auto column = static_cast<Eigen::Index>(i);
    if (!given[i].per_run) result.col(column) = thetas.col(column);
  }
  if (other.population()) DrawFromPopulation(other, xis, order, result);
  if (same_runs && own.per_run()) TakeOwnRuns(own, thetas, other, result);
  return result;
}

absl::Status OfRecord(const absl::Status& status) {
  return RenameFields(status, [](const std::string& name) {
    return name == "measurements" ? std::string("record") : name;
  });
}

std::vector<PredictedNoise> NoiseOf(const Assessed& assessed, const RecordSummary& record,
                                    const LearnedNoise& learned, const ResolvedProblem& problem) {
  std::vector<PredictedNoise> noise;
  for (size_t c = 0; c < learned.channels.size(); ++c) {
    const ChannelEstimate& channel = assessed.estimate.channels[c];
    PredictedNoise& added = noise.emplace_back();
    if (c < record.channels().size()) added.largest = record.channels()[c].largest;
    if (!problem.problem().measured[c].noise.unknown) {
      added.scale = std::sqrt(learned.misfit);
    } else if (!learned.channels[c].learned || channel.samples == 0) {
      added.scale = 0;
    } else {
      added.scale = channel.noise_std_dev / record.channels()[c].RootMeanSquareNoise();
      const double share =
          static_cast<double>(channel.samples) / static_cast<double>(assessed.estimate.samples);
      added.degrees_of_freedom =
          std::max(1.0, channel.effective_samples - share * problem.dimension());
    }
  }
  return noise;
}

Matrix EquallyWeightedThetas(const PosteriorDraws& draws, const Prior& prior, int count) {
  const std::vector<Eigen::Index> chosen = StratifiedDraws(draws.weights, count);
  Matrix thetas(count, prior.dimension());
  for (int i = 0; i < prior.dimension(); ++i) {
    thetas.col(i) =
        draws.scores.col(i)(chosen).unaryExpr([&](double z) { return prior.OfScore(i, z); });
  }
  return thetas;
}

namespace {

// Numbers that the smoothers of one batch of draws keep; 64 MB.
constexpr int64_t kNumbersOfBatch = 8'000'000;

// Returns how many draws are smoothed together: each keeps matrices of all states at each instant.
Eigen::Index DrawsOfBatch(const ResolvedProblem& problem, int64_t instants) {
  const int64_t n = std::ssize(problem.model()->description().states);
  return std::max<int64_t>(1, kNumbersOfBatch / (instants * (3 * n * n + 3 * n)));
}

// What smoothers of all draws tell of an instant.
struct SmoothedInstant {
  TrajectoryInstant instant;
  std::vector<double> samples;
  Matrix means, deviations, jump_scores;  // draws × outputs
};

// Smooths batch by batch. A batch visits the same instants as the others.
absl::StatusOr<Prediction> PredictSmoothed(const PredictionSubject& subject,
                                           const PredictionOptions& options,
                                           const std::vector<int>& columns, int threads,
                                           const Stop& stop) {
  PredictionBuilder builder(subject, options, columns);
  const Eigen::Index draws = subject.thetas.rows();
  const Eigen::Index batch =
      DrawsOfBatch(*subject.problem, std::max<int64_t>(1, CountTimes(options, subject.rows)));
  const FilterUse use{
      .horizon_s = 0, .smooth = true, .visits = [&](int64_t row) { return builder.Returns(row); }};
  std::vector<SmoothedInstant> instants;
  int failed = 0;
  for (Eigen::Index first = 0; first < draws; first += batch) {
    const Eigen::Index count = std::min(batch, draws - first);
    size_t next = 0;
    const auto visit = [&](const TrajectoryInstant& instant, const ConstMatrixRef& means,
                           const ConstMatrixRef& deviations) {
      if (first == 0) {
        instants.push_back({instant,
                            {instant.samples.begin(), instant.samples.end()},
                            Matrix(draws, means.cols()),
                            Matrix(draws, means.cols()),
                            Matrix(draws, means.cols())});
      }
      instants[next].means.middleRows(first, count) = means;
      instants[next].jump_scores.middleRows(first, count) = *instant.jump_scores;
      instants[next++].deviations.middleRows(first, count) = deviations;
      return absl::OkStatus();
    };
    RecordTrajectories trajectories(*subject.problem, *subject.store,
                                    subject.thetas.middleRows(first, count), columns, use, threads);
    POLYEST_RETURN_IF_ERROR(trajectories.Run(subject.rows, options.times, visit, stop));
    failed += trajectories.failed();
  }
  for (SmoothedInstant& smoothed : instants) {
    smoothed.instant.samples = smoothed.samples;
    smoothed.instant.jump_scores = &smoothed.jump_scores;
    POLYEST_RETURN_IF_ERROR(builder.Add(smoothed.instant, smoothed.means, smoothed.deviations));
  }
  return builder.Take(failed);
}

}  // namespace

absl::StatusOr<Prediction> Predict(const PredictionSubject& subject,
                                   const PredictionOptions& options, int threads,
                                   const Stop& stop) {
  if (options.forecast_s > 0) {
    PredictionOptions at_times = options;
    at_times.forecast_s = 0;
    POLYEST_ASSIGN_OR_RETURN(at_times.times, ForecastTimes(subject, options));
    return Predict(subject, at_times, threads, stop);
  }
  POLYEST_ASSIGN_OR_RETURN(const std::vector<int> columns,
                           ChooseOutputs(*subject.problem, options.outputs));
  if (options.smoothed) return PredictSmoothed(subject, options, columns, threads, stop);
  PredictionBuilder builder(subject, options, columns);
  RecordTrajectories trajectories(*subject.problem, *subject.store, subject.thetas, columns,
                                  {.horizon_s = options.horizon_s, .smooth = false, .visits = {}},
                                  threads);
  const auto visit = [&](const TrajectoryInstant& instant, const ConstMatrixRef& values,
                         const ConstMatrixRef& deviations) {
    return builder.Add(instant, values, deviations);
  };
  POLYEST_RETURN_IF_ERROR(trajectories.Run(subject.rows, options.times, visit, stop));
  return builder.Take(trajectories.failed());
}

}  // namespace polyest::internal
