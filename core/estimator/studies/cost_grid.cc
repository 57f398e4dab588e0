#include "core/estimator/studies/cost_grid.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "core/bayes/mismatch.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/record/known_inputs_store.h"
#include "core/estimator/record/sample_checks.h"
#include "core/estimator/studies/record_pass.h"
#include "core/estimator/studies/study_options.h"

namespace polyest::internal {
namespace {

// Number of grid points processed at once; it bounds the memory.
constexpr Eigen::Index kPointsAtATime = 1024;
// Half the range of an axis without a bound, in standard deviations from the mean.
constexpr double kDeviations = 4;

// Returns the columns of the uncertain parameters on the axes.
absl::StatusOr<std::vector<int>> ChooseAxes(const Prior& prior, const CostGridOptions& options) {
  if (options.parameters.empty()) {
    return prior.dimension() == 1 ? std::vector<int>{0} : std::vector<int>{0, 1};
  }
  if (options.parameters.size() > 2) {
    return InvalidField("parameters", absl::StrFormat("%d are given; a grid is over one or two",
                                                      options.parameters.size()));
  }
  std::vector<int> axes;
  for (size_t i = 0; i < options.parameters.size(); ++i) {
    const std::string field = absl::StrFormat("parameters[%d]", i);
    POLYEST_ASSIGN_OR_RETURN(const int axis, FindUncertain(prior, field, options.parameters[i]));
    if (!axes.empty() && axes.front() == axis) {
      return InvalidField(field, absl::StrFormat("%s is given twice", options.parameters[i]));
    }
    axes.push_back(axis);
  }
  return axes;
}

absl::StatusOr<Eigen::Index> ChoosePoints(const CostGridOptions& options, size_t axes) {
  if (options.points == 0) return axes == 1 ? 201 : 41;
  if (options.points < 2) {
    return InvalidField(
        "points", absl::StrFormat("%d must be at least 2, or 0 for the default", options.points));
  }
  const auto points = static_cast<int64_t>(options.points);
  const int64_t all = axes == 1 ? points : points * points;
  if (all > kMaxGridPoints) {
    return FieldError(absl::StatusCode::kResourceExhausted, "points",
                      absl::StrFormat("%d an axis make %d runs of the model; the limit is %d",
                                      points, all, kMaxGridPoints));
  }
  return static_cast<Eigen::Index>(points);
}

// Returns the scores of the held parameters: those of the prior mean, except for the given values.
absl::StatusOr<Vector> HeldScores(const Prior& prior, const CostGridOptions& options,
                                  const std::vector<int>& axes) {
  const Vector mean = prior.Mean();
  Vector z(prior.dimension());
  for (int i = 0; i < prior.dimension(); ++i) z[i] = prior.ScoreOf(i, mean[i]);
  for (const auto& [name, value] : options.held) {
    const FieldPath field{"held", FieldStep::Key(name)};
    POLYEST_ASSIGN_OR_RETURN(const int column, FindUncertain(prior, field, name));
    if (std::find(axes.begin(), axes.end(), column) != axes.end()) {
      return InvalidField(field,
                          absl::StrFormat("%s is on an axis of the grid and cannot be held", name));
    }
    z[column] = prior.ScoreOf(column, value);
    if (!std::isfinite(z[column]) || z[column] < prior.lower()[column] ||
        z[column] > prior.upper()[column]) {
      return InvalidField(field, absl::StrFormat("%g lies outside the prior of %s", value, name));
    }
  }
  return z;
}

// Returns α² of the total cost.
absl::StatusOr<double> ChooseRegularization(const Problem& problem,
                                            const CostGridOptions& options) {
  if (options.regularization) {
    if (std::isfinite(*options.regularization) && *options.regularization >= 0) {
      return *options.regularization;
    }
    return InvalidField("regularization", absl::StrFormat("%g must be finite and at least 0",
                                                          *options.regularization));
  }
  if (problem.regularization_mode == RegularizationMode::kFixed) return problem.regularization;
  return InvalidField("regularization", "must be given for a problem in which a rule chooses it");
}

// Returns scores along an axis: over Ω, or mean ± 4 standard deviations where Ω has no bound.
Vector AxisScores(const Germ& germ, Eigen::Index points) {
  const double reach = kDeviations * germ.StandardDeviation();
  const double lower = std::isfinite(germ.Lower()) ? germ.Lower() : germ.Mean() - reach;
  const double upper = std::isfinite(germ.Upper()) ? germ.Upper() : germ.Mean() + reach;
  Vector axis = Vector::LinSpaced(points, lower, upper);
  axis[points - 1] = upper;  // exact, so the point lies in Ω
  return axis;
}

// Computes J_mismatch of every row of `thetas` from runs of the model over the whole record, as the
// estimator reads it. Outliers are not handled, since there is no estimate to judge them by.
class ModelMismatch {
 public:
  // `store` has the whole record.
  ModelMismatch(const ResolvedProblem& problem, const SampleStore& store, int threads)
      : problem_(problem),
        rows_(store.rows()),
        pass_(problem, store, NoiseAsStated(problem.problem()), threads) {}

  absl::StatusOr<Vector> Evaluate(const Matrix& thetas, const Stop& stop) const {
    const Eigen::Index m = problem_.channels();
    Sums sums{Matrix::Zero(thetas.rows(), m), Matrix::Zero(thetas.rows(), m),
              Matrix::Zero(thetas.rows(), m), Vector::Zero(m)};
    const auto add = [&](const RowBlock& block, const Matrix& outputs, bool begins_run) {
      if (begins_run) EndRun(sums);
      for (Eigen::Index row = 0; row < block.count(); ++row) {
        AddRow(block, row, outputs.middleCols(row * m, m), sums);
      }
      // The model fails at such a point, even if nothing is measured from then on.
      for (Eigen::Index i = 0; i < outputs.rows(); ++i) {
        if (outputs.row(i).hasNaN()) sums.chi_squared.row(i).setConstant(kInfinity);
      }
    };
    POLYEST_RETURN_IF_ERROR(pass_.Run(thetas, rows_, /*late_s=*/0, add, stop));
    EndRun(sums);
    return Total(sums);
  }

 private:
  // With u_k a residual in units of its noise: Σ u_k², Σ (u_k − u_{k−1})² and the last u_k, by
  // point and channel, and the number of samples by channel. Of a point that fails they are not
  // finite.
  struct Sums {
    Matrix chi_squared, differences, previous;
    Vector samples;
  };

  static std::vector<ChannelNoise> NoiseAsStated(const Problem& problem) {
    std::vector<ChannelNoise> noise = NoiseToBeginWith(problem).channels;
    for (ChannelNoise& channel : noise) channel.scale = 1;
    return noise;
  }

  static void EndRun(Sums& sums) {
    sums.differences.array() += sums.previous.array().square();
    sums.previous.setZero();
  }

  // `outputs`: points × channels.
  void AddRow(const RowBlock& block, Eigen::Index row, const ConstMatrixRef& outputs,
              Sums& sums) const {
    const Eigen::Index m = problem_.channels();
    const Eigen::Index width = std::ssize(block.values) / block.count();
    for (Eigen::Index c = 0; c < m; ++c) {
      const double sigma = block.noise[static_cast<size_t>(row * m + c)];
      if (!(sigma > 0)) continue;  // missing
      const double z = block.values[static_cast<size_t>(row * width + c)];
      const Eigen::ArrayXd u = (z - outputs.col(c).array()) / sigma;
      sums.chi_squared.col(c).array() += u.square();
      sums.differences.col(c).array() += (u - sums.previous.col(c).array()).square();
      sums.previous.col(c) = u.matrix();
      ++sums.samples[c];
    }
  }

  Vector Total(const Sums& sums) const {
    Vector mismatch = Vector::Zero(sums.chi_squared.rows());
    for (Eigen::Index c = 0; c < sums.samples.size(); ++c) {
      const NoiseModel& noise = problem_.problem().measured[static_cast<size_t>(c)].noise;
      for (Eigen::Index i = 0; i < mismatch.size(); ++i) {
        const double chi_squared = sums.chi_squared(i, c);
        mismatch[i] += std::isfinite(chi_squared)
                           ? NegativeLogLikelihood(sums.samples[c], chi_squared,
                                                   sums.differences(i, c), noise.unknown,
                                                   noise.correlation == NoiseCorrelation::kUnknown)
                           : kInfinity;
      }
    }
    return mismatch;
  }

  const ResolvedProblem& problem_;
  int64_t rows_;
  RecordPass pass_;
};

// Replaces NaN by +∞, the value of J where the model could not be run.
Matrix WithoutNotANumber(Matrix values) {
  for (double& value : values.reshaped()) {
    if (std::isnan(value)) value = kInfinity;
  }
  return values;
}

// Fills in J at the points of the grid, given by their scores with the first axis running fastest.
absl::Status FillGrid(const ResolvedProblem& problem, const ModelMismatch& model,
                      const Matrix& scores, CostGrid& grid, const Stop& stop) {
  const Prior& prior = problem.prior();
  Matrix thetas(scores.rows(), scores.cols());
  for (Eigen::Index i = 0; i < scores.rows(); ++i) {
    const Vector xi = prior.OfScores(scores.row(i).transpose());
    thetas.row(i) = prior.ToParameters(xi).transpose();
    grid.prior.reshaped()[i] = prior.NegativeLogDensity(xi);
  }
  for (Eigen::Index first = 0; first < scores.rows(); first += kPointsAtATime) {
    const Eigen::Index count = std::min(kPointsAtATime, scores.rows() - first);
    POLYEST_ASSIGN_OR_RETURN(const Vector mismatch,
                             model.Evaluate(thetas.middleRows(first, count), stop));
    grid.mismatch.reshaped().segment(first, count) = mismatch;
  }
  grid.mismatch = WithoutNotANumber(std::move(grid.mismatch));
  grid.total = grid.mismatch;
  if (grid.regularization > 0) grid.total += grid.regularization * grid.prior;
  return absl::OkStatus();
}

// Sets the grid's axes, of so many points each, and returns the scores of its points, the first
// axis running fastest: those of `held`, but for the axes' own.
Matrix SpreadAxes(const ResolvedProblem& problem, const std::vector<int>& axes, Eigen::Index points,
                  const Vector& held, CostGrid& grid) {
  const Prior& prior = problem.prior();
  const Eigen::Index second = axes.size() == 2 ? points : 1;
  Matrix scores = held.transpose().replicate(points * second, 1);
  for (size_t a = 0; a < axes.size(); ++a) {
    const auto parameter = static_cast<size_t>(axes[a]);
    const Vector axis = AxisScores(prior.germs()[parameter], points);
    grid.parameters.push_back(prior.parameters()[parameter].name);
    grid.units.push_back(problem.units()[parameter]);
    grid.axes.push_back(axis.unaryExpr([&](double z) { return prior.OfScore(axes[a], z); }));
    for (Eigen::Index i = 0; i < scores.rows(); ++i) {
      scores(i, axes[a]) = axis[a == 0 ? i % points : i / points];
    }
  }
  grid.mismatch.resize(points, second);
  grid.prior.resize(points, second);
  return scores;
}

}  // namespace

absl::StatusOr<CostGrid> EvaluateCostGrid(const ResolvedProblem& problem, const Samples& samples,
                                          const CostGridOptions& options, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(RefuseFilters(problem.problem(), "a cost grid"));
  const Prior& prior = problem.prior();
  if (problem.channels() == 0) {
    return InvalidField("measured", "at least one output must be measured");
  }
  POLYEST_RETURN_IF_ERROR(CheckAtLeast("threads", options.threads, 1));
  POLYEST_ASSIGN_OR_RETURN(CheckedSamples record, SampleChecks(problem).Check(samples));
  if (record.after.run >= problem.max_joint_runs()) {
    return InvalidField(
        "measurements",
        absl::StrFormat("%d runs are more than a grid may have, %d, since each has parameters of "
                        "its own",
                        record.after.run + 1, problem.max_joint_runs()));
  }
  if (problem.per_run() && record.after.run >= problem.runs()) {
    POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem grown, problem.WithRuns(record.after.run + 1));
    return EvaluateCostGrid(grown, samples, options, stop);
  }
  POLYEST_ASSIGN_OR_RETURN(const std::vector<int> axes, ChooseAxes(prior, options));
  POLYEST_ASSIGN_OR_RETURN(const Eigen::Index points, ChoosePoints(options, axes.size()));
  POLYEST_ASSIGN_OR_RETURN(const Vector held, HeldScores(prior, options, axes));

  CostGrid grid;
  POLYEST_ASSIGN_OR_RETURN(grid.regularization, ChooseRegularization(problem.problem(), options));
  const Matrix scores = SpreadAxes(problem, axes, points, held, grid);
  record.run_ended = true;  // nothing follows
  const std::shared_ptr<SampleStore> store = StoreFor(problem, nullptr);
  POLYEST_RETURN_IF_ERROR(store->Append(record));
  const ModelMismatch model(problem, *store, options.threads);
  POLYEST_RETURN_IF_ERROR(FillGrid(problem, model, scores, grid, stop));
  return grid;
}

}  // namespace polyest::internal
