#include "core/estimator/record/run_filters.h"

#include "core/common/status.h"

namespace polyest::internal {

RunFilters::RunFilters(const ResolvedProblem& problem, const Matrix& thetas,
                       const std::vector<int>& outputs, int run, const InputSignals* inputs,
                       double horizon_s, int threads)
    : asked_(std::ssize(outputs)),
      horizon_s_(horizon_s),
      behind_(problem.MakeEnsemble(thetas, problem.outputs(), threads, run), inputs),
      ahead_(problem.MakeEnsemble(thetas, AskedAndMeasured(problem, outputs), threads, run),
             inputs),
      pending_(0, problem.channels()) {}

absl::Status RunFilters::Predict(double time_s, MatrixRef means, MatrixRef deviations,
                                 const Stop& stop) {
  const bool ends = horizon_s_ == 0 || time_s > window_start_s_ + horizon_s_;
  if (ends && !pending_.empty()) POLYEST_RETURN_IF_ERROR(EndWindow(stop));
  Matrix all_means(means.rows(), ahead_.outputs()), all_deviations = all_means;
  POLYEST_RETURN_IF_ERROR(ahead_.Predict(time_s, all_means, all_deviations, stop));
  means = all_means.leftCols(asked_);
  deviations = all_deviations.leftCols(asked_);
  return absl::OkStatus();
}

absl::Status RunFilters::EndWindow(const Stop& stop) {
  window_start_s_ = pending_.last_time_s();
  POLYEST_RETURN_IF_ERROR(pending_.Give(behind_, stop));
  ahead_.TakeStatesOf(behind_);
  return absl::OkStatus();
}

}  // namespace polyest::internal
