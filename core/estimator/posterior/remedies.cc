#include "core/estimator/posterior/remedies.h"

#include <absl/strings/str_cat.h>

#include "core/estimator/problem/process_noise.h"

namespace polyest::internal {

std::string AdviseProcessNoise(const ResolvedProblem& resolved) {
  Problem problem = resolved.problem();
  if (problem.model->description().states.empty() || UsesFilters(problem)) return "";
  const std::string& state = problem.model->description().states.front().name;
  problem.process_noise = {{.state = state, .unknown = true, .lower = 1, .upper = 2}};
  problem.likelihood.reset();
  if (!CheckFilters(problem).empty() || resolved.delays_outputs()) return "";
  return "; where disturbances act on states, give these processNoise (polyest explain tries it)";
}

std::string AdviseDrift(const ResolvedProblem& resolved, int parameter) {
  Problem problem = resolved.problem();
  const std::string& name = resolved.prior().parameters()[static_cast<size_t>(parameter)].name;
  for (UncertainParameter& one : problem.uncertain) {
    if (one.name != name || one.drift) continue;
    one.drift = RandomWalk{.std_dev_per_sqrt_s = 1};
    problem.likelihood.reset();
    if (!CheckFilters(problem).empty() || resolved.delays_outputs()) return "";
    return absl::StrCat("; if ", name,
                        " changes with time, let it drift (polyest explain tries it)");
  }
  return "";
}

}  // namespace polyest::internal
