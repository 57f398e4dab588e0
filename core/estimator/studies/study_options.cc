#include "core/estimator/studies/study_options.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>

#include "polyest/posterior.h"

namespace polyest::internal {

absl::Status CheckProbabilities(const std::vector<double>& probabilities) {
  if (probabilities.size() > kMaxProbabilities) {
    return InvalidField("probabilities", absl::StrFormat("%d are given; the limit is %d",
                                                         probabilities.size(), kMaxProbabilities));
  }
  for (size_t i = 0; i < probabilities.size(); ++i) {
    if (probabilities[i] > 0 && probabilities[i] < 1) continue;
    return InvalidField(FieldPath{"probabilities", i},
                        absl::StrFormat("%g must be above 0 and below 1", probabilities[i]));
  }
  return absl::OkStatus();
}

absl::StatusOr<int> FindUncertain(const Prior& prior, const FieldPath& field,
                                  const std::string& name) {
  const std::vector<std::string> names = prior.Names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  return InvalidField(field, absl::StrFormat("\"%s\" is not among the uncertain parameters %s",
                                             name, absl::StrJoin(names, ", ")));
}

}  // namespace polyest::internal
