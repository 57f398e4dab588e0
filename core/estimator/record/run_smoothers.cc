#include "core/estimator/record/run_smoothers.h"

#include "core/common/status.h"

namespace polyest::internal {

RunSmoothers::RunSmoothers(const ResolvedProblem& problem, const Matrix& thetas,
                           const std::vector<int>& outputs, int run, const InputSignals* inputs,
                           int threads)
    : asked_(std::ssize(outputs)),
      filters_(problem.MakeEnsemble(thetas, AskedAndMeasured(problem, outputs), threads, run),
               inputs),
      pending_(asked_, problem.channels()) {
  filters_.StartBackward();
}

absl::Status RunSmoothers::Mark(double time_s, const Stop& stop) {
  if (!pending_.empty()) POLYEST_RETURN_IF_ERROR(pending_.Give(filters_, stop));
  marks_s_.push_back(time_s);
  return filters_.Mark(time_s, stop);
}

absl::Status RunSmoothers::Finish(const Stop& stop) {
  if (!pending_.empty()) POLYEST_RETURN_IF_ERROR(pending_.Give(filters_, stop));
  filters_.FinishBackward();
  return absl::OkStatus();
}

void RunSmoothers::Read(size_t mark, MatrixRef means, MatrixRef deviations) {
  Matrix all_means(means.rows(), filters_.outputs()), all_deviations = all_means;
  filters_.ReadMarked(mark, marks_s_[mark], all_means, all_deviations);
  means = all_means.leftCols(asked_);
  deviations = all_deviations.leftCols(asked_);
}

}  // namespace polyest::internal
