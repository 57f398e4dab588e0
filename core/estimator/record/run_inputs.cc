#include "core/estimator/record/run_inputs.h"

#include <vector>

namespace polyest::internal {

RunInputs::RunInputs(const ResolvedProblem& problem, int run)
    : problem_(problem), run_(run), signals_(problem.MakeInputs()) {}

void RunInputs::Append(const RowBlock& block, size_t row) {
  const std::vector<int>& streamed = problem_.streamed_inputs();
  if (streamed.empty()) return;
  const size_t width = block.values.size() / block.rows.size();
  const auto channels = static_cast<size_t>(problem_.channels());
  size_t k = row;
  for (; k < block.rows.size() && block.rows[k].run == run_; ++k) {
    const double time_s = block.rows[k].time_s;
    if (time_s <= last_knot_s_) continue;
    for (size_t i = 0; i < streamed.size(); ++i) {
      const double value = block.values[k * width + channels + i];
      signals_[static_cast<size_t>(streamed[i])].Append(time_s, value);
    }
    last_knot_s_ = time_s;
  }
  const bool complete = k < block.rows.size() || block.run_ended;
  if (!complete || finished_) return;
  for (const int input : streamed) signals_[static_cast<size_t>(input)].Finish();
  finished_ = true;
}

}  // namespace polyest::internal
