#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "core/chaos/basis.h"
#include "core/chaos/collocation_matrix.h"
#include "core/common/status.h"
#include "core/estimator/studies.h"

namespace polyest {
namespace {

// Columns (output × time) worked on at once: bounds the memory and the time between two looks at
// Stop.
constexpr int64_t kColumnsAtATime = 128;

struct Columns {
  std::vector<int> of_model;
  std::vector<std::string> names;
  std::vector<std::string> units;
};

absl::StatusOr<Columns> ChooseOutputs(const ResolvedProblem& problem,
                                      const std::vector<std::string>& asked) {
  const ModelDescription& model = problem.problem().model->description();
  Columns columns;
  if (asked.empty()) {
    columns.of_model = problem.outputs();
    if (columns.of_model.empty()) {
      columns.of_model.resize(model.outputs.size());
      std::iota(columns.of_model.begin(), columns.of_model.end(), 0);
    }
  }
  std::vector<std::string> known;
  for (const Quantity& output : model.outputs) known.push_back(output.name);
  for (size_t i = 0; i < asked.size(); ++i) {
    const auto column = model.FindOutput(asked[i]);
    if (!column) {
      return absl::InvalidArgumentError(
          absl::StrFormat("outputs[%d]: model %s has no output \"%s\"; it has %s", i, model.name,
                          asked[i], absl::StrJoin(known, ", ")));
    }
    if (std::count(columns.of_model.begin(), columns.of_model.end(), *column) > 0) {
      return absl::InvalidArgumentError(
          absl::StrFormat("outputs[%d]: output %s is given twice", i, asked[i]));
    }
    columns.of_model.push_back(*column);
  }
  for (const int column : columns.of_model) {
    columns.names.push_back(model.outputs[static_cast<size_t>(column)].name);
    columns.units.push_back(model.outputs[static_cast<size_t>(column)].unit);
  }
  return columns;
}

absl::Status CheckNoStreamedInput(const ResolvedProblem& problem) {
  if (problem.streamed_inputs().empty()) return absl::OkStatus();
  const auto column = static_cast<size_t>(problem.streamed_inputs().front());
  return absl::InvalidArgumentError(absl::StrFormat(
      "inputs: %s is streamed, but a propagation has no data to carry it; give it as a table",
      problem.problem().model->description().inputs[column].name));
}

// 0, step, 2 step … until, the last one included when it is a multiple but for rounding.
int64_t TimeCount(const PropagationOptions& options) {
  const double steps = std::floor(options.until_s / options.step_s * (1 + 1e-12));
  return steps < 1e15 ? static_cast<int64_t>(steps) + 1 : int64_t{1} << 50;
}

// The limit on what a propagation answers: past it a caller wants another tool, not more memory.
absl::Status CheckSize(const PropagationOptions& options, size_t outputs) {
  const auto numbers = static_cast<int64_t>(4 + options.probabilities.size() +
                                            2 * static_cast<size_t>(options.density_bins));
  const int64_t times = TimeCount(options);
  const int64_t values =
      std::min(times, kMostPropagatedValues + 1) * numbers * static_cast<int64_t>(outputs);
  if (values <= kMostPropagatedValues) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrFormat(
      "until/step: %d times of %d outputs with %d numbers each are more than the limit of %d "
      "numbers",
      times, outputs, numbers, kMostPropagatedValues));
}

// The expansion of every output at every time, and what is read off it.
class Propagator {
 public:
  Propagator(const ResolvedProblem& problem, const PropagationOptions& options, Columns columns,
             std::shared_ptr<const Basis> basis, Matrix points, CollocationMatrix matrix)
      : prior_(problem.prior()),
        options_(options),
        columns_(std::move(columns)),
        basis_(std::move(basis)),
        points_(std::move(points)),
        matrix_(std::move(matrix)),
        kept_(static_cast<size_t>(points_.rows())),
        inputs_(problem.MakeInputs()),
        ensemble_(problem.MakeEnsemble(Thetas(), columns_.of_model, options.threads), &inputs_) {
    std::iota(kept_.begin(), kept_.end(), 0);
  }

  absl::StatusOr<Propagation> Run(const Stop& stop) {
    Prepare();
    const auto m = static_cast<int64_t>(columns_.names.size());
    const int64_t at_a_time = std::max<int64_t>(1, kColumnsAtATime / m);
    for (int64_t first = 0; first < times(); first += at_a_time) {
      POLYEST_RETURN_IF_ERROR(AdvanceThrough(first, std::min(at_a_time, times() - first), stop));
    }
    result_.failures = ensemble_.failures();
    return std::move(result_);
  }

 private:
  int64_t times() const { return static_cast<int64_t>(result_.time_s.size()); }

  Matrix Thetas() const {
    Matrix thetas(points_.rows(), points_.cols());
    for (Eigen::Index q = 0; q < points_.rows(); ++q) {
      thetas.row(q) = prior_.ToParameters(points_.row(q).transpose()).transpose();
    }
    return thetas;
  }

  void Prepare() {
    for (int64_t k = 0; k < TimeCount(options_); ++k) {
      result_.time_s.push_back(
          std::min(static_cast<double>(k) * options_.step_s, options_.until_s));
    }
    for (size_t i = 0; i < columns_.names.size(); ++i) {
      PropagatedOutput output;
      output.output = columns_.names[i];
      output.unit = columns_.units[i];
      output.mean.resize(times());
      output.standard_deviation.resize(times());
      output.residual.resize(times());
      output.quantiles.resize(times(), static_cast<Eigen::Index>(options_.probabilities.size()));
      result_.outputs.push_back(std::move(output));
    }
    result_.order = basis_->order();
    result_.terms = basis_->size();
    result_.points = static_cast<int>(points_.rows());
  }

  absl::Status AdvanceThrough(int64_t first, int64_t count, const Stop& stop) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    const std::span<const double> at(result_.time_s.data() + first, static_cast<size_t>(count));
    const auto m = static_cast<Eigen::Index>(columns_.names.size());
    Matrix values(points_.rows(), m * count);
    POLYEST_RETURN_IF_ERROR(ensemble_.Advance(at, values, stop));
    POLYEST_RETURN_IF_ERROR(LeaveOutFailed());
    // c = A⁺ Y (10)
    Matrix coefficients(basis_->size(), values.cols());
    Vector residual_variance(values.cols());
    matrix_.Solve(values(kept_, Eigen::all), coefficients, residual_variance);
    const Expansion expansion(basis_, std::move(coefficients));
    const bool sampled = !options_.probabilities.empty() || options_.density_bins > 0;
    const Matrix samples = sampled ? expansion.Sample(options_.density_samples) : Matrix();
    const Vector mean = expansion.Mean();
    const Vector deviation = expansion.StandardDeviation();
    for (Eigen::Index column = 0; column < values.cols(); ++column) {
      PropagatedOutput& output = result_.outputs[static_cast<size_t>(column % m)];
      const Eigen::Index k = first + column / m;
      output.mean[k] = mean[column];
      output.standard_deviation[k] = deviation[column];
      output.residual[k] = std::sqrt(residual_variance[column]);
      if (sampled) Describe(samples.col(column), k, output);
    }
    return absl::OkStatus();
  }

  void Describe(const ConstVectorRef& samples, Eigen::Index k, PropagatedOutput& output) const {
    Vector sorted = samples;
    std::sort(sorted.begin(), sorted.end());
    for (size_t i = 0; i < options_.probabilities.size(); ++i) {
      output.quantiles(k, static_cast<Eigen::Index>(i)) =
          QuantileOfSamples(sorted, options_.probabilities[i]);
    }
    if (options_.density_bins > 0) {
      output.densities.push_back(DensityOfSamples(sorted, options_.density_bins));
    }
  }

  // Points that failed are left out of the fit from the times of this call of Advance on.
  absl::Status LeaveOutFailed() {
    const std::vector<PointFailure>& failures = ensemble_.failures();
    if (kept_.size() + failures.size() == static_cast<size_t>(points_.rows())) {
      return absl::OkStatus();
    }
    std::set<int> failed;
    for (const PointFailure& failure : failures) failed.insert(failure.point);
    std::erase_if(kept_, [&](int point) { return failed.contains(point); });
    if (kept_.size() <= static_cast<size_t>(basis_->size())) {
      const PointFailure& last = *std::max_element(
          failures.begin(), failures.end(),
          [](const PointFailure& a, const PointFailure& b) { return a.time_s < b.time_s; });
      return absl::FailedPreconditionError(absl::StrFormat(
          "only %d of %d collocation points could be integrated and an expansion of %d terms needs "
          "more; at %s the model failed at t = %g s: %s (solver flag %d)",
          kept_.size(), points_.rows(), basis_->size(), DescribePoint(last.point), last.time_s,
          last.reason, last.flag));
    }
    POLYEST_ASSIGN_OR_RETURN(matrix_,
                             CollocationMatrix::Factor(*basis_, points_(kept_, Eigen::all)));
    return absl::OkStatus();
  }

  std::string DescribePoint(int point) const {
    const Vector theta = prior_.ToParameters(points_.row(point).transpose());
    std::vector<std::string> values;
    for (int i = 0; i < prior_.dimension(); ++i) {
      values.push_back(
          absl::StrFormat("%s = %g", prior_.parameters()[static_cast<size_t>(i)].name, theta[i]));
    }
    return absl::StrJoin(values, ", ");
  }

  const Prior& prior_;
  const PropagationOptions& options_;
  Columns columns_;
  std::shared_ptr<const Basis> basis_;
  Matrix points_;  // Q × n
  CollocationMatrix matrix_;
  std::vector<int> kept_;  // the points still in the fit
  InputSignals inputs_;
  EnsemblePropagator ensemble_;
  Propagation result_;
};

}  // namespace

absl::Status PropagationOptions::Validate() const {
  const auto positive = [](const char* field, double value) {
    if (value > 0 && std::isfinite(value)) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrFormat("%s: %g must be a finite number > 0", field, value));
  };
  POLYEST_RETURN_IF_ERROR(positive("until", until_s));
  POLYEST_RETURN_IF_ERROR(positive("step", step_s));
  if (step_s > until_s) {
    return absl::InvalidArgumentError(
        absl::StrFormat("step: %g must be at most until %g", step_s, until_s));
  }
  for (size_t i = 0; i < probabilities.size(); ++i) {
    if (probabilities[i] >= 0 && probabilities[i] <= 1) continue;
    return absl::InvalidArgumentError(
        absl::StrFormat("probabilities[%d]: %g must lie between 0 and 1", i, probabilities[i]));
  }
  if (density_bins < 0 || density_bins > kMostDensityBins) {
    return absl::InvalidArgumentError(absl::StrFormat("densityBins: %d must lie between 0 and %d",
                                                      density_bins, kMostDensityBins));
  }
  if (density_samples < 1 || density_samples > kMostDensitySamples) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "densitySamples: %d must lie between 1 and %d", density_samples, kMostDensitySamples));
  }
  if (threads < 1) {
    return absl::InvalidArgumentError(absl::StrFormat("threads: %d must be at least 1", threads));
  }
  return absl::OkStatus();
}

absl::StatusOr<Propagation> PropagatePrior(const ResolvedProblem& problem,
                                           const PropagationOptions& options, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(options.Validate());
  POLYEST_RETURN_IF_ERROR(CheckNoStreamedInput(problem));
  POLYEST_ASSIGN_OR_RETURN(Columns columns, ChooseOutputs(problem, options.outputs));
  POLYEST_RETURN_IF_ERROR(CheckSize(options, columns.names.size()));
  const ExpansionOptions& design = problem.problem().expansion;
  const std::vector<Germ> germs = problem.prior().germs();
  auto basis = std::make_shared<const Basis>(germs, design.order);
  const int count = static_cast<int>(std::ceil(design.points_per_term * basis->size()));
  POLYEST_ASSIGN_OR_RETURN(Matrix points,
                           CollocationPoints(design.points, germs, design.order, count));
  POLYEST_ASSIGN_OR_RETURN(CollocationMatrix matrix, CollocationMatrix::Factor(*basis, points));
  Propagator propagator(problem, options, std::move(columns), std::move(basis), std::move(points),
                        std::move(matrix));
  return propagator.Run(stop);
}

}  // namespace polyest
