// The fit of the outputs' coefficients at each row, without the trajectories that have failed
// (fitted_trajectories.h).

#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/fitted_trajectories.h"

namespace polyest::internal {

// Fits each stretch of rows over which the same trajectories are valid. Fails on a stop request
// only.
absl::Status FittedTrajectories::FitRows(int first, int count, FittedBlock& block,
                                         const Stop& stop) {
  for (int begin = first; begin < first + count;) {
    absl::Status dropped = DropFailed(begin, block, stop);
    if (!dropped.ok() && !IsInfeasible(dropped)) return dropped;
    shortage_ = std::move(dropped);
    if (!shortage_.ok()) return absl::OkStatus();
    int end = begin + 1;
    while (end < first + count && !FailsAt(end, block)) ++end;
    const int columns = (end - begin) * channels_;
    FitColumns(begin * channels_, columns, block.outputs, block.coefficients,
               block.residual_variance);
    check_basis_.Multiply(block.coefficients.middleCols(begin * channels_, columns),
                          block.check_predictions.middleCols(begin * channels_, columns));
    if (filters_) {
      FitColumns(begin * channels_, columns, block.log_variances, block.log_variance_coefficients,
                 block.log_variance_residual);
    }
    block.fitted_rows = begin = end;
  }
  return absl::OkStatus();
}

// Fits some columns of `all_values` (a row for each trajectory).
void FittedTrajectories::FitColumns(int first, int count, const Matrix& all_values,
                                    Matrix& coefficients, Vector& residual) {
  const auto values = all_values.block(0, first, points(), count);
  auto fit = coefficients.middleCols(first, count);
  auto residuals = residual.segment(first, count);
  if (matrix_.points() == points()) {
    matrix_.Solve(values, fit, residuals, threads_);
  } else {
    matrix_.Solve(values(kept_, Eigen::all), fit, residuals, threads_);
  }
}

// Takes the error of interpolating delayed outputs for one of the expansion's own.
void FittedTrajectories::AddDelayErrors(int first, FittedBlock& block) const {
  if (filters_) return;
  const Vector& errors = propagator_->delay_errors();
  if (errors.size() == 0) return;
  const int begin = first * channels_;
  const int columns = std::max(0, block.fitted_rows - first) * channels_;
  block.residual_variance.segment(begin, columns) += errors.head(columns).cwiseAbs2();
}

// Whether a trajectory still in the fit has no output at this row of the block.
bool FittedTrajectories::FailsAt(int row, const FittedBlock& block) const {
  const auto values = block.outputs.block(0, row * channels_, points(), channels_);
  if (values.allFinite()) return false;
  for (const int q : kept_) {
    if (!values.row(q).allFinite()) return true;
  }
  return false;
}

// Leaves out the trajectories without output at this row, and factors the remaining collocation
// points again.
absl::Status FittedTrajectories::DropFailed(int row, const FittedBlock& block, const Stop& stop) {
  if (!FailsAt(row, block)) return absl::OkStatus();
  NoteFailures(row, block);
  const auto values = block.outputs.block(0, row * channels_, points(), channels_);
  std::erase_if(kept_, [&](int q) { return !values.row(q).allFinite(); });
  const int needed = design_.basis->size() + (problem_.problem().expansion.adaptive ? 1 : 0);
  if (static_cast<int>(kept_.size()) < needed) {
    return InfeasibleError(absl::StrFormat(
        "only %d of %d trajectories could be integrated to t = %g s and the expansion needs %d; "
        "the last to fail: %s",
        kept_.size(), points(), block.Row(row).time_s, needed,
        failures_.empty() ? "not known" : DescribeFailure(failures_.back(), problem_.prior())));
  }
  const Matrix left = design_.points(kept_, Eigen::all);
  POLYEST_ASSIGN_OR_RETURN(matrix_, CollocationMatrix::Factor(*design_.basis, left, stop));
  return absl::OkStatus();
}

// Records each trajectory that fails at this row once. The propagator may be ahead of the row and
// report later failures too.
void FittedTrajectories::NoteFailures(int row, const FittedBlock& block) {
  const std::vector<PointFailure>& failures =
      filters_ ? filters_->failures() : propagator_->failures();
  for (const PointFailure& failure : failures) {
    const bool kept = std::binary_search(kept_.begin(), kept_.end(), failure.point);
    const auto outputs = block.outputs.block(failure.point, row * channels_, 1, channels_);
    if (!kept || outputs.allFinite()) continue;
    failures_.push_back({thetas_.row(failure.point).transpose(), run_, failure.time_s, failure.flag,
                         failure.reason});
  }
}

}  // namespace polyest::internal
