#include "core/estimator/expansion/prior_expansion.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "core/chaos/collocation_points.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/problem/truncation.h"
#include "core/model/list_names.h"

namespace polyest::internal {
namespace {

// Number of columns (output × time) processed at once. It bounds the memory and the time between
// two checks of the stop request.
constexpr int64_t kColumnsAtATime = 128;
constexpr size_t kMinDraws = 2;  // have a variance
// As many times of a grid as this are not counted any more.
constexpr int64_t kMaxCounted = int64_t{1} << 50;

// Draws of the prior that continue the low-discrepancy sequence of the collocation points, so that
// none of them is one.
Matrix DrawPrior(const std::vector<Germ>& germs, Eigen::Index points, int draws) {
  const int count = static_cast<int>(points) + draws;
  return HaltonDraws(germs, count).bottomRows(draws);
}

absl::Status CheckNoStreamedInput(const ResolvedProblem& problem) {
  if (problem.streamed_inputs().empty()) return absl::OkStatus();
  const auto column = static_cast<size_t>(problem.streamed_inputs().front());
  return InvalidField(
      "inputs",
      absl::StrFormat("%s is streamed, but this study needs inputs that are known in advance; "
                      "replace its \"streamed\" by a \"table\"",
                      problem.problem().model->description().inputs[column].name));
}

absl::StatusOr<std::vector<int>> FindOutputs(const ModelDescription& model,
                                             const std::vector<std::string>& asked) {
  std::vector<int> columns;
  for (size_t i = 0; i < asked.size(); ++i) {
    const auto column = model.FindOutput(asked[i]);
    if (!column) {
      return InvalidField(FieldPath{"outputs", i},
                          absl::StrFormat("model %s has no output \"%s\"; it has %s", model.name,
                                          asked[i], ListNames(model.outputs)));
    }
    if (std::count(columns.begin(), columns.end(), *column) > 0) {
      return InvalidField(FieldPath{"outputs", i},
                          absl::StrFormat("output %s is given twice", asked[i]));
    }
    columns.push_back(*column);
  }
  return columns;
}

}  // namespace

absl::Status TimeGrid::Validate() const {
  const auto positive = [](const char* field, double value) {
    if (value > 0 && std::isfinite(value)) return absl::OkStatus();
    return InvalidField(field, absl::StrFormat("%g must be a finite number > 0", value));
  };
  POLYEST_RETURN_IF_ERROR(positive("until_s", until_s));
  POLYEST_RETURN_IF_ERROR(positive("step_s", step_s));
  if (step_s > until_s) {
    return InvalidField("step_s", absl::StrFormat("%g must be at most until %g", step_s, until_s));
  }
  return absl::OkStatus();
}

int64_t TimeGrid::count() const {
  const double ratio = until_s / step_s;
  // The margin for rounding is never a step, however many there are.
  const double steps = std::floor(ratio + std::min(1e-12 * ratio, 0.5));
  return steps < static_cast<double>(kMaxCounted) ? static_cast<int64_t>(steps) + 1 : kMaxCounted;
}

double TimeGrid::time_s(int64_t k) const {
  return std::min(static_cast<double>(k) * step_s, until_s);
}

std::vector<double> TimeGrid::times_s() const {
  std::vector<double> times(static_cast<size_t>(count()));
  for (size_t k = 0; k < times.size(); ++k) times[k] = time_s(static_cast<int64_t>(k));
  return times;
}

absl::Status CheckAnswerSize(const TimeGrid& grid, size_t outputs, int64_t numbers, int64_t most) {
  const int64_t times = grid.count();
  const int64_t values = std::min(times, most + 1) * numbers * static_cast<int64_t>(outputs);
  if (values <= most) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrFormat(
      "until/step: %s times of %d outputs with %d numbers each are more than the limit of %d "
      "numbers",
      times < kMaxCounted ? absl::StrCat(times) : absl::StrCat("more than ", kMaxCounted - 1),
      outputs, numbers, most));
}

absl::StatusOr<std::vector<int>> ChooseOutputs(const ResolvedProblem& problem,
                                               const std::vector<std::string>& asked) {
  if (!asked.empty()) return FindOutputs(problem.model()->description(), asked);
  const std::vector<Quantity>& outputs = problem.model()->description().outputs;
  std::vector<int> chosen = problem.outputs();
  // The parameters that drift follow the model's own outputs.
  size_t next = chosen.empty() ? 0 : problem.problem().model->description().outputs.size();
  for (; next < outputs.size(); ++next) chosen.push_back(static_cast<int>(next));
  return chosen;
}

absl::Status CheckIsOfThePrior(const ResolvedProblem& problem) {
  POLYEST_RETURN_IF_ERROR(RefuseFilters(problem.problem(), "a study of the prior"));
  return CheckNoStreamedInput(problem);
}

absl::Status PropagateOver(const TimeGrid& grid, int64_t m, EnsemblePropagator& ensemble,
                           absl::FunctionRef<absl::Status(int64_t, const Matrix&)> visit,
                           const Stop& stop) {
  const std::vector<double> times = grid.times_s();
  const int64_t at_a_time = std::max<int64_t>(1, kColumnsAtATime / m);
  for (int64_t first = 0; first < grid.count(); first += at_a_time) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    const int64_t count = std::min(at_a_time, grid.count() - first);
    Matrix values(ensemble.points(), m * count);
    POLYEST_RETURN_IF_ERROR(
        ensemble.Advance({times.data() + first, static_cast<size_t>(count)}, values, stop));
    POLYEST_RETURN_IF_ERROR(visit(first, values));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<PriorExpansion>> PriorExpansion::Make(const ResolvedProblem& problem,
                                                                     std::vector<int> outputs,
                                                                     int draws, int threads,
                                                                     const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckIsOfThePrior(problem));
  const ExpansionOptions& design = problem.problem().expansion;
  const std::vector<Germ>& germs = problem.prior().germs();
  auto basis = std::make_shared<const Basis>(germs, FirstTruncation(design, problem.dimension()));
  const int count = static_cast<int>(PointCount(design, basis->size()));
  POLYEST_ASSIGN_OR_RETURN(Matrix points,
                           CollocationPoints(design.points, germs, basis->order(), count));
  POLYEST_ASSIGN_OR_RETURN(CollocationMatrix matrix,
                           CollocationMatrix::Factor(*basis, points, stop));
  return std::unique_ptr<PriorExpansion>(new PriorExpansion(problem, std::move(outputs),
                                                            std::move(basis), std::move(points),
                                                            std::move(matrix), draws, threads));
}

PriorExpansion::PriorExpansion(const ResolvedProblem& problem, std::vector<int> outputs,
                               std::shared_ptr<const Basis> basis, Matrix points,
                               CollocationMatrix matrix, int draws, int threads)
    : prior_(problem.prior()),
      outputs_(std::move(outputs)),
      basis_(std::move(basis)),
      points_(std::move(points)),
      matrix_(std::move(matrix)),
      draws_(DrawPrior(prior_.germs(), points_.rows(), draws)),
      kept_points_(static_cast<size_t>(points_.rows())),
      kept_draws_(static_cast<size_t>(draws_.rows())),
      inputs_(problem.MakeInputs()),
      ensemble_(problem.MakeEnsemble(Thetas(), outputs_, threads), &inputs_) {
  std::iota(kept_points_.begin(), kept_points_.end(), 0);
  std::iota(kept_draws_.begin(), kept_draws_.end(), this->points());
  basis_->EvaluateMany(draws_, draw_basis_);
}

absl::Status PriorExpansion::Run(const TimeGrid& grid,
                                 absl::FunctionRef<void(const ExpandedOutputs&)> visit,
                                 const Stop& stop) {
  const auto m = static_cast<int64_t>(outputs_.size());
  const auto expand = [&](int64_t first, const Matrix& values) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(LeaveOutFailed(stop));
    visit(Expand(first, values));
    return absl::OkStatus();
  };
  return PropagateOver(grid, m, ensemble_, expand, stop);
}

ExpandedOutputs PriorExpansion::Expand(int64_t first, const Matrix& values) {
  // c = A⁺ Y (10). A trajectory with an output beyond 1e100 has failed (output_limit.h), so that
  // squares of c do not overflow.
  Matrix coefficients(basis_->size(), values.cols());
  Vector fit_variance(values.cols());
  matrix_.Solve(values(kept_points_, Eigen::all), coefficients, fit_variance);
  Matrix model = values(kept_draws_, Eigen::all);
  std::vector<int> rows;  // of draw_basis_
  for (const int row : kept_draws_) rows.push_back(row - points());
  const Matrix difference = model - draw_basis_(rows, Eigen::all) * coefficients;
  Vector variance =
      difference.colwise().squaredNorm().transpose() / static_cast<double>(rows.size());
  return {first, values.cols() / static_cast<Eigen::Index>(outputs_.size()),
          Expansion(basis_, std::move(coefficients)), std::move(model), std::move(variance)};
}

Vector ExpandedOutputs::ModelVariance() const {
  const Matrix centred = model.rowwise() - model.colwise().mean();
  return centred.colwise().squaredNorm().transpose() / static_cast<double>(model.rows() - 1);
}

Matrix PriorExpansion::Thetas() const {
  Matrix thetas(trajectories(), points_.cols());
  for (int row = 0; row < trajectories(); ++row) {
    const Vector xi = row < points() ? points_.row(row) : draws_.row(row - points());
    thetas.row(row) = prior_.ToParameters(xi).transpose();
  }
  return thetas;
}

// Leaves failed points out of the fit, and failed draws out of the comparison, beginning with the
// times of this call of Advance.
absl::Status PriorExpansion::LeaveOutFailed(const Stop& stop) {
  if (kept_points_.size() + kept_draws_.size() + failures().size() ==
      static_cast<size_t>(trajectories())) {
    return absl::OkStatus();
  }
  std::set<int> failed;
  for (const PointFailure& failure : failures()) failed.insert(failure.point);
  const auto has_failed = [&](int row) { return failed.contains(row); };
  std::erase_if(kept_draws_, has_failed);
  if (std::erase_if(kept_points_, has_failed) > 0 || kept_draws_.size() < kMinDraws) {
    if (kept_points_.size() <= static_cast<size_t>(basis_->size()) ||
        kept_draws_.size() < kMinDraws) {
      return TooFewLeft();
    }
    POLYEST_ASSIGN_OR_RETURN(
        matrix_, CollocationMatrix::Factor(*basis_, points_(kept_points_, Eigen::all), stop));
  }
  return absl::OkStatus();
}

absl::Status PriorExpansion::TooFewLeft() const {
  const PointFailure& last =
      *std::max_element(failures().begin(), failures().end(),
                        [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
  return absl::FailedPreconditionError(absl::StrFormat(
      "only %d of %d collocation points and %d of %d draws of the prior could be integrated and an "
      "expansion of %d terms needs more points, and at least %d draws; at %s the model failed at t "
      "= %g s: %s (solver flag %d)",
      kept_points_.size(), points(), kept_draws_.size(), draws(), basis_->size(), kMinDraws,
      DescribePoint(last.point), last.time_s, last.reason, last.flag));
}

std::string PriorExpansion::DescribePoint(int point) const {
  const Vector xi = point < points() ? points_.row(point) : draws_.row(point - points());
  const Vector theta = prior_.ToParameters(xi);
  std::vector<std::string> values;
  for (int i = 0; i < prior_.dimension(); ++i) {
    values.push_back(
        absl::StrFormat("%s = %g", prior_.parameters()[static_cast<size_t>(i)].name, theta[i]));
  }
  return absl::StrJoin(values, ", ");
}

Diagnostic DescribeFailures(const std::vector<PointFailure>& failures, int points) {
  const PointFailure& first = failures.front();
  return {DiagnosticCode::kPointsFailed,
          absl::StrFormat("%d of %d trajectories could not be integrated and were left out; the "
                          "first of them failed after %g s: %s",
                          failures.size(), points, first.time_s, first.reason)};
}

}  // namespace polyest::internal
