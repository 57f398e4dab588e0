#pragma once

// Checks that the options of several studies have in common.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/bayes/prior.h"
#include "core/common/field_error.h"

namespace polyest::internal {

// Refuses more than kMaxProbabilities of them, and one that is not above 0 and below 1.
absl::Status CheckProbabilities(const std::vector<double>& probabilities);

// Returns the column of an uncertain parameter, or INVALID_ARGUMENT for `field` if there is none of
// that name.
absl::StatusOr<int> FindUncertain(const Prior& prior, const FieldPath& field,
                                  const std::string& name);

}  // namespace polyest::internal
