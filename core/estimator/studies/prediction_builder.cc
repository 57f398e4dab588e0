#include "core/estimator/studies/prediction_builder.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/bayes/noise.h"
#include "core/bayes/weighted_samples.h"
#include "core/chaos/expansion.h"
#include "core/chaos/germ.h"
#include "core/estimator/problem/settable_quantities.h"
#include "core/estimator/studies/prediction_score.h"

namespace polyest::internal {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Returns the measured output that reads the model's output `column`; −1 if none does.
int ChannelOf(const ResolvedProblem& problem, int column) {
  const auto found = std::find(problem.outputs().begin(), problem.outputs().end(), column);
  return found == problem.outputs().end() ? -1
                                          : static_cast<int>(found - problem.outputs().begin());
}

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

}  // namespace

// Finds the most certain abrupt change of a parameter that drifts.
class JumpSearch {
 public:
  // `scores`: of all draws that can be integrated to here.
  void Add(const SampleRow& place, const ConstVectorRef& scores) {
    const double score = scores.mean();
    ++times_;
    if (!(std::abs(score) > std::abs(found_.score))) return;  // nor where it is not a number
    found_ = {place, score, 0};
  }
  std::optional<AbruptChange> Take() {
    if (times_ == 0) return std::nullopt;
    // One of so many normal scores is beyond the limit, on either side, with this probability at
    // most (Bonferroni, two-sided).
    constexpr double kChance = 0.01;
    found_.limit = Germ::Normal().Quantile(1 - kChance / static_cast<double>(2 * times_));
    if (std::abs(found_.score) > found_.limit) return found_;
    return std::nullopt;
  }

 private:
  int64_t times_ = 0;
  AbruptChange found_;
};

// Predicts one output at the times of an answer, and scores it on the record.
class OutputPrediction {
 public:
  // `index`: of the output in the answer; `column`: among the model's.
  OutputPrediction(const PredictionSubject& subject, const PredictionOptions& options,
                   Eigen::Index index, int column, int64_t times)
      : options_(options), index_(index), channel_(ChannelOf(*subject.problem, column)) {
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
    const bool filters = subject.problem->uses_filters();
    const bool tailed = model_.outliers == OutlierHandling::kStudentT;
    kernel_ = tailed && !filters ? NoiseKernel::kStudentT : NoiseKernel::kNormal;
    if (noise_.scale <= 0 || options.smoothed) return;
    const int draws = static_cast<int>(subject.thetas.rows());
    factors_ = noise_.degrees_of_freedom > 0 ? ScaleFactors(noise_.degrees_of_freedom, draws)
                                             : Vector(Vector::Ones(draws));
    UseUncertainNoise(subject);
    // Student's t beside the filters' own normal distribution: a scale mixture over the draws.
    if (tailed && filters) {
      factors_ = factors_.cwiseProduct(ScaleFactors(kStudentTDegreesOfFreedom, draws)).eval();
    }
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
    if (instant.jump_scores != nullptr) {
      jumps_.Add(instant.place, instant.jump_scores->col(index_)(alive));
    }
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
    const bool scored = !std::isnan(z) && instant.row >= options_.first_scored_row;
    AddSample(PredictiveDensity(kernel_, values, scales), z, z - mean, scored, place);
  }

  PredictedOutput Take() {
    if (sums_) result_.score = sums_->Score();
    result_.abrupt_change = jumps_.Take();
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
          QuantileOfSorted(sorted, options_.probabilities[i]);
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

  void AddSample(const PredictiveDensity& density, double z, double residual, bool scored,
                 Eigen::Index place) {
    const double spread = density.StandardDeviation();
    if (place >= 0) {
      result_.sample_std_dev[place] = spread;
      for (size_t i = 0; i < options_.probabilities.size(); ++i) {
        result_.sample_quantiles(place, static_cast<Eigen::Index>(i)) =
            density.Quantile(options_.probabilities[i]);
      }
      result_.standardized_residual[place] = residual / spread;
    }
    if (!scored) return;
    sums_->Add({residual, residual / spread, density.LogDensity(z), density.Cumulative(z)});
  }

  const PredictionOptions& options_;
  Eigen::Index index_;
  int channel_;
  PredictedNoise noise_;
  NoiseModel model_;
  NoiseKernel kernel_ = NoiseKernel::kNormal;
  Vector factors_;  // of the noise's scale, by draw
  int run_ = -1;
  JumpSearch jumps_;
  std::optional<ScoreSums> sums_;
  PredictedOutput result_;
};

PredictionBuilder::PredictionBuilder(const PredictionSubject& subject,
                                     const PredictionOptions& options,
                                     const std::vector<int>& columns)
    : by_rows_(options.times.empty()), selection_(subject.rows, options.max_rows) {
  const int64_t times = by_rows_ ? selection_.size() : std::ssize(options.times);
  for (const int column : columns) {
    outputs_.emplace_back(subject, options, std::ssize(outputs_), column, times);
  }
  prediction_.draws = static_cast<int>(subject.thetas.rows());
  prediction_.record_rows = subject.rows;
}

PredictionBuilder::~PredictionBuilder() = default;

absl::Status PredictionBuilder::Add(const TrajectoryInstant& instant, const ConstMatrixRef& values,
                                    const ConstMatrixRef& deviations) {
  const std::vector<Eigen::Index> alive = Alive(values);
  if (std::ssize(alive) < std::max(kMinDraws, values.rows() / 2)) {
    return TooFewTrajectories(instant, alive.size(), values.rows());
  }
  const bool asked = instant.row < 0;
  Eigen::Index place = -1;
  if (asked || by_rows_) {
    place = asked ? std::ssize(prediction_.rows) : selection_.PlaceOf(instant.row);
  }
  if (place >= 0) prediction_.rows.push_back(instant.place);
  for (size_t i = 0; i < outputs_.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const Vector spread = deviations.size() > 0 ? Vector(deviations(alive, column))
                                                : Vector(Vector::Zero(std::ssize(alive)));
    outputs_[i].Add(instant, values(alive, column), spread, alive, place);
  }
  return absl::OkStatus();
}

Prediction PredictionBuilder::Take(int failed) {
  for (OutputPrediction& output : outputs_) prediction_.outputs.push_back(output.Take());
  prediction_.failed = failed;
  return std::move(prediction_);
}

}  // namespace polyest::internal
