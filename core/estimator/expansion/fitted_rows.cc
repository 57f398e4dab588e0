// The fit of the outputs' coefficients at each row (regional_expansion.h).

#include <algorithm>
#include <utility>

#include "core/common/infeasible.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// Fits each stretch of rows over which the same trajectories are valid. Fails on a stop request
// only.
absl::Status RegionalExpansion::FitRows(int first, int count, const Stop& stop) {
  for (int begin = first; begin < first + count;) {
    absl::Status dropped = DropFailed(begin, stop);
    if (!dropped.ok() && !IsInfeasible(dropped)) return dropped;
    shortage_ = std::move(dropped);
    if (!shortage_.ok()) return absl::OkStatus();
    int end = begin + 1;
    while (end < first + count && !FailsAt(end)) ++end;
    const int columns = (end - begin) * channels_;
    FitColumns(begin * channels_, columns, outputs_, coefficients_, residual_variance_);
    check_basis_.Multiply(coefficients_.middleCols(begin * channels_, columns),
                          check_predictions_.middleCols(begin * channels_, columns));
    if (filters_) {
      FitColumns(begin * channels_, columns, log_variances_, log_variance_coefficients_,
                 log_variance_residual_);
    }
    fitted_rows_ = begin = end;
  }
  return absl::OkStatus();
}

// Fits some columns of `all_values` (a row for each trajectory).
void RegionalExpansion::FitColumns(int first, int count, const Matrix& all_values,
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
void RegionalExpansion::AddDelayErrors(int first) {
  if (filters_) return;
  const Vector& errors = propagator_->delay_errors();
  if (errors.size() == 0) return;
  const int begin = first * channels_;
  const int columns = std::max(0, fitted_rows_ - first) * channels_;
  residual_variance_.segment(begin, columns) += errors.head(columns).cwiseAbs2();
}

}  // namespace polyest::internal
