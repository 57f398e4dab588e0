#include "core/estimator/problem/parameters_of_runs.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/problem/logarithmic_germs.h"

namespace polyest::internal {
namespace {

// Returns the correlations between shared parameters, and those between per-run parameters for each
// run.
absl::StatusOr<std::vector<Correlation>> CorrelationsOfRuns(
    const std::vector<UncertainParameter>& parameters, const std::vector<Correlation>& correlations,
    int runs, int first_run) {
  std::vector<Correlation> all;
  const auto per_run = [&parameters](const std::string& name) {
    return std::ranges::any_of(parameters, [&name](const UncertainParameter& parameter) {
      return parameter.name == name && parameter.per_run;
    });
  };
  for (size_t i = 0; i < correlations.size(); ++i) {
    const Correlation& given = correlations[i];
    if (per_run(given.first) != per_run(given.second)) {
      return InvalidField(
          FieldPath{"correlations", i},
          absl::StrFormat("only one of %s and %s is per run; a correlation needs both or neither",
                          given.first, given.second));
    }
    const int end = per_run(given.first) ? runs : first_run + 1;
    for (int run = first_run; run < end; ++run) {
      all.push_back(given);
      if (!per_run(given.first)) continue;
      all.back().first = absl::StrFormat("%s[%d]", given.first, run);
      all.back().second = absl::StrFormat("%s[%d]", given.second, run);
    }
  }
  return all;
}

}  // namespace

std::vector<UncertainParameter> ParametersOfRuns(const std::vector<UncertainParameter>& given,
                                                 int runs, int first_run) {
  std::vector<UncertainParameter> all;
  for (int run = first_run; run < runs; ++run) {
    for (const UncertainParameter& parameter : given) {
      if (run > first_run && !parameter.per_run) continue;
      all.push_back(parameter);
      if (parameter.per_run) all.back().name = absl::StrFormat("%s[%d]", parameter.name, run);
    }
  }
  return all;
}

absl::StatusOr<Prior> PriorOfRuns(const std::vector<UncertainParameter>& given,
                                  const std::vector<Correlation>& correlations, int runs,
                                  int first_run) {
  POLYEST_ASSIGN_OR_RETURN(std::vector<Correlation> all,
                           CorrelationsOfRuns(given, correlations, runs, first_run));
  return Prior::Make(ByLogarithms(ParametersOfRuns(given, runs, first_run), all), all);
}

}  // namespace polyest::internal
