#include "core/estimator/record/run_smoothers.h"

#include <algorithm>
#include <string>

#include "core/common/status.h"
#include "core/estimator/problem/drifting_model.h"

namespace polyest::internal {
namespace {

std::vector<int> WalksOf(const ModelDescription& model, const std::vector<int>& outputs) {
  std::vector<int> walks;
  for (const int output : outputs) {
    const std::string name = DriftName(model.outputs[static_cast<size_t>(output)].name);
    const auto found = std::ranges::find(model.states, name, &Quantity::name);
    walks.push_back(found == model.states.end() ? -1
                                                : static_cast<int>(found - model.states.begin()));
  }
  return walks;
}

}  // namespace

RunSmoothers::RunSmoothers(const ResolvedProblem& problem, const Matrix& thetas,
                           const std::vector<int>& outputs, int run, const InputSignals* inputs,
                           int threads)
    : asked_(std::ssize(outputs)),
      walks_(WalksOf(problem.model()->description(), outputs)),
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

absl::Status RunSmoothers::Read(size_t mark, MatrixRef means, MatrixRef deviations) {
  Matrix all_means(means.rows(), filters_.outputs()), all_deviations = all_means;
  POLYEST_RETURN_IF_ERROR(filters_.ReadMarked(mark, marks_s_[mark], all_means, all_deviations));
  means = all_means.leftCols(asked_);
  deviations = all_deviations.leftCols(asked_);
  return absl::OkStatus();
}

void RunSmoothers::ReadJumpScores(size_t mark, MatrixRef scores) const {
  Matrix of_states(scores.rows(), filters_.states());
  filters_.ReadJumpScores(mark, of_states);
  scores.setZero();
  for (size_t i = 0; i < walks_.size(); ++i) {
    if (walks_[i] >= 0) scores.col(static_cast<Eigen::Index>(i)) = of_states.col(walks_[i]);
  }
}

}  // namespace polyest::internal
