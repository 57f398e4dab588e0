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
#include "core/chaos/expansion.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/expansion/prior_expansion.h"
#include "core/estimator/problem/settable_quantities.h"
#include "core/estimator/studies/prediction_score.h"

namespace polyest::internal {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr Eigen::Index kLeastDraws = 2;

// Returns the measured output that reads the model's output `column`; −1 if none does.
int ChannelOf(const ResolvedProblem& problem, int column) {
  const auto found = std::find(problem.outputs().begin(), problem.outputs().end(), column);
  return found == problem.outputs().end() ? -1
                                          : static_cast<int>(found - problem.outputs().begin());
}

// Predicts one output at the times of an answer, and scores it on the record.
class OutputPrediction {
 public:
  OutputPrediction(const PredictionSubject& subject, const PredictionOptions& options, int column,
                   int64_t times)
      : options_(options), channel_(ChannelOf(*subject.problem, column)) {
    const Quantity& quantity =
        subject.problem->model()->description().outputs[static_cast<size_t>(column)];
    result_.output = quantity.name;
    result_.unit = quantity.unit;
    const auto probabilities = std::ssize(options.probabilities);
    result_.mean.resize(times);
    result_.std_dev.resize(times);
    result_.quantiles.resize(times, probabilities);
    if (channel_ < 0) return;
    result_.measured.setConstant(times, kNone);
    result_.residual.setConstant(times, kNone);
    noise_ = subject.noise[static_cast<size_t>(channel_)];
    model_ = subject.problem->problem().measured[static_cast<size_t>(channel_)].noise;
    kernel_ = model_.outliers == OutlierHandling::kStudentT ? NoiseKernel::kStudentT
                                                            : NoiseKernel::kNormal;
    if (noise_.scale <= 0) return;
    const int draws = static_cast<int>(subject.thetas.rows());
    factors_ = noise_.degrees_of_freedom > 0 ? ScaleFactors(noise_.degrees_of_freedom, draws)
                                             : Vector(Vector::Ones(draws));
    UseUncertainNoise(subject);
    sums_.emplace(options.lags);
    result_.sample_std_dev.resize(times);
    result_.sample_quantiles.resize(times, probabilities);
    result_.standardized_residual.setConstant(times, kNone);
  }

  // `values`: of all draws that can be integrated to here, `alive` their indices, with the standard
  // deviations of filters (0 without). `place`: in the answer; −1 if the time is not returned.
  void Add(const TrajectoryInstant& instant, const ConstVectorRef& values,
           const ConstVectorRef& deviations, const std::vector<Eigen::Index>& alive,
           Eigen::Index place) {
    if (instant.row >= 0 && instant.place.run != run_) {
      run_ = instant.place.run;
      if (sums_) sums_->EndRun();
    }
    const double mean = values.mean();
    if (place >= 0) Describe(values, deviations, mean, place);
    if (channel_ < 0) return;
    const double z = instant.row >= 0 ? instant.samples[static_cast<size_t>(channel_)] : kNone;
    if (!std::isnan(z)) noise_.largest = std::max(noise_.largest, std::abs(z));
    if (place >= 0) {
      result_.measured[place] = z;
      result_.residual[place] = z - mean;
    }
    const double sigma = noise_.scale * model_.StandardDeviation(mean, noise_.largest);
    if (!sums_ || (std::isnan(z) && place < 0)) return;
    if (sigma <= 0) {
      if (place >= 0) DescribeExactSample(place);
      return;
    }
    const Vector scales =
        (deviations.cwiseAbs2() + (sigma * factors_(alive)).cwiseAbs2()).cwiseSqrt();
    AddSample(PredictiveDensity(kernel_, values, scales), z, z - mean, place);
  }

  PredictedOutput Take() {
    if (sums_) result_.score = sums_->Score();
    return std::move(result_);
  }

 private:
  // Takes the noise at each draw where it is an uncertain parameter.
  void UseUncertainNoise(const PredictionSubject& subject) {
    const std::vector<std::string> names = subject.problem->prior().Names();
    const auto found = std::ranges::find(names, NoiseName(result_.output));
    if (found != names.end()) {
      factors_ = subject.thetas.col(found - names.begin()) / model_.absolute;
    }
  }

  void Describe(const ConstVectorRef& values, const ConstVectorRef& deviations, double mean,
                Eigen::Index place) {
    result_.mean[place] = mean;
    if (deviations.minCoeff() > 0) {
      return DescribeMixture(PredictiveDensity(NoiseKernel::kNormal, values, deviations), place);
    }
    result_.std_dev[place] =
        std::sqrt((values.array() - mean).square().sum() / static_cast<double>(values.size() - 1));
    Vector sorted = values;
    std::sort(sorted.begin(), sorted.end());
    for (size_t i = 0; i < options_.probabilities.size(); ++i) {
      result_.quantiles(place, static_cast<Eigen::Index>(i)) =
          QuantileOfSamples(sorted, options_.probabilities[i]);
    }
  }

  void DescribeMixture(const PredictiveDensity& density, Eigen::Index place) {
    result_.std_dev[place] = density.StandardDeviation();
    for (size_t i = 0; i < options_.probabilities.size(); ++i) {
      result_.quantiles(place, static_cast<Eigen::Index>(i)) =
          density.Quantile(options_.probabilities[i]);
    }
  }

  // Relative noise before any signal: a sample of 0 is exact and says nothing.
  void DescribeExactSample(Eigen::Index place) {
    result_.sample_std_dev[place] = result_.std_dev[place];
    result_.standardized_residual[place] = 0;
    result_.sample_quantiles.row(place) = result_.quantiles.row(place);
  }

  void AddSample(const PredictiveDensity& density, double z, double residual, Eigen::Index place) {
    const double spread = density.StandardDeviation();
    if (place >= 0) {
      result_.sample_std_dev[place] = spread;
      for (size_t i = 0; i < options_.probabilities.size(); ++i) {
        result_.sample_quantiles(place, static_cast<Eigen::Index>(i)) =
            density.Quantile(options_.probabilities[i]);
      }
      result_.standardized_residual[place] = residual / spread;
    }
    if (std::isnan(z)) return;
    sums_->Add({residual, residual / spread, density.LogDensity(z), density.Cumulative(z)});
  }

  const PredictionOptions& options_;
  int channel_;
  PredictedNoise noise_;
  NoiseModel model_;
  NoiseKernel kernel_ = NoiseKernel::kNormal;
  Vector factors_;  // of the noise's scale, by draw
  int run_ = -1;
  std::optional<ScoreSums> sums_;
  PredictedOutput result_;
};

// Selects the rows of an answer: at most `most` of `rows`, evenly spaced.
class RowSelection {
 public:
  RowSelection(int64_t rows, int64_t most) : rows_(rows), most_(std::min(rows, most)) {}
  int64_t size() const { return most_; }
  // Returns the place of a row in the answer; −1 if it is left out.
  int64_t PlaceOf(int64_t row) const {
    const int64_t place = row * most_ / rows_;
    return row == 0 || place != (row - 1) * most_ / rows_ ? place : -1;
  }

 private:
  int64_t rows_, most_;
};

std::vector<Eigen::Index> Alive(const ConstMatrixRef& outputs) {
  std::vector<Eigen::Index> alive;
  for (Eigen::Index d = 0; d < outputs.rows(); ++d) {
    if (outputs.row(d).allFinite()) alive.push_back(d);
  }
  return alive;
}

absl::Status TooFewTrajectories(const TrajectoryInstant& instant, size_t alive,
                                Eigen::Index draws) {
  return absl::FailedPreconditionError(absl::StrFormat(
      "only %d of %d trajectories at draws of the posterior could be integrated to t = %g s of run "
      "%d",
      alive, draws, instant.place.time_s, instant.place.run));
}

// Returns the number of numbers that each output has at each time.
int64_t NumbersPerTime(const PredictionOptions& options) {
  constexpr int64_t kPlain = 6;  // mean, standard deviations, sample, residuals
  return kPlain + 2 * std::ssize(options.probabilities);
}

}  // namespace

absl::Status Validate(const PredictionOptions& options, const ResolvedProblem& problem,
                      int64_t rows) {
  POLYEST_ASSIGN_OR_RETURN(const std::vector<int> columns, ChooseOutputs(problem, options.outputs));
  for (size_t i = 0; i < options.probabilities.size(); ++i) {
    if (options.probabilities[i] > 0 && options.probabilities[i] < 1) continue;
    return InvalidField(FieldPath{"probabilities", i},
                        absl::StrFormat("%g must lie between 0 and 1", options.probabilities[i]));
  }
  POLYEST_RETURN_IF_ERROR(CheckRange("draws", options.draws, kLeastDraws, kMaxPredictionDraws));
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
  POLYEST_RETURN_IF_ERROR(CheckRange("lags", options.lags, 0, kMaxPredictionLags));
  POLYEST_RETURN_IF_ERROR(CheckRange("times", std::ssize(options.times), 0, kMaxPredictionRows));
  const int64_t times =
      options.times.empty() ? std::min(rows, options.max_rows) : std::ssize(options.times);
  const int64_t numbers = times * std::ssize(columns) * NumbersPerTime(options);
  if (numbers <= kMaxPredictedValues) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrFormat("the prediction would have %d numbers, the limit is %d; ask for fewer rows, "
                      "outputs or probabilities",
                      numbers, kMaxPredictedValues));
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

}  // namespace

Matrix ThetasOfOtherRuns(const ResolvedProblem& own, const Matrix& thetas,
                         const ResolvedProblem& other) {
  const Prior& prior = other.prior();
  const auto draws = static_cast<int>(thetas.rows());
  // The points of Halton's sequence are distributed as the prior.
  const Matrix xis = CollocationPoints(PointSet::kHalton, prior.germs(), 1, draws).value();
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
  const std::vector<Eigen::Index> chosen = EquallyWeighted(draws.weights, count);
  Matrix thetas(count, prior.dimension());
  for (int i = 0; i < prior.dimension(); ++i) {
    thetas.col(i) =
        draws.scores.col(i)(chosen).unaryExpr([&](double z) { return prior.OfScore(i, z); });
  }
  return thetas;
}

absl::StatusOr<Prediction> Predict(const PredictionSubject& subject,
                                   const PredictionOptions& options, int threads,
                                   const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const std::vector<int> columns,
                           ChooseOutputs(*subject.problem, options.outputs));
  const RowSelection selection(subject.rows, options.max_rows);
  const bool by_rows = options.times.empty();
  const int64_t times = by_rows ? selection.size() : std::ssize(options.times);
  std::vector<OutputPrediction> outputs;
  for (const int column : columns) outputs.emplace_back(subject, options, column, times);
  Prediction prediction;
  prediction.draws = static_cast<int>(subject.thetas.rows());
  prediction.record_rows = subject.rows;
  RecordTrajectories trajectories(*subject.problem, *subject.store, subject.thetas, columns,
                                  options.horizon_s, threads);
  const auto visit = [&](const TrajectoryInstant& instant, const ConstMatrixRef& values,
                         const ConstMatrixRef& deviations) -> absl::Status {
    const std::vector<Eigen::Index> alive = Alive(values);
    if (std::ssize(alive) < std::max(kLeastDraws, values.rows() / 2)) {
      return TooFewTrajectories(instant, alive.size(), values.rows());
    }
    const bool asked = instant.row < 0;
    Eigen::Index place = -1;
    if (asked || by_rows)
      place = asked ? std::ssize(prediction.rows) : selection.PlaceOf(instant.row);
    if (place >= 0) prediction.rows.push_back(instant.place);
    for (size_t i = 0; i < outputs.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      const Vector spread = deviations.size() > 0 ? Vector(deviations(alive, column))
                                                  : Vector(Vector::Zero(std::ssize(alive)));
      outputs[i].Add(instant, values(alive, column), spread, alive, place);
    }
    return absl::OkStatus();
  };
  POLYEST_RETURN_IF_ERROR(trajectories.Run(subject.rows, options.times, visit, stop));
  for (OutputPrediction& output : outputs) prediction.outputs.push_back(output.Take());
  prediction.failed = trajectories.failed();
  return prediction;
}

}  // namespace polyest::internal
