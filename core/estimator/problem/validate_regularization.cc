#include "core/estimator/problem/validate_regularization.h"

#include <absl/strings/str_format.h>

#include <cmath>

#include "core/common/field_error.h"

namespace polyest::internal {

absl::Status ValidateRegularization(const Problem& problem) {
  if (!std::isfinite(problem.regularization) || problem.regularization < 0) {
    return InvalidField("regularization",
                        absl::StrFormat("%g must be a finite number ≥ 0", problem.regularization));
  }
  if (problem.regularization_mode != RegularizationMode::kDiscrepancy) return absl::OkStatus();
  for (size_t i = 0; i < problem.measured.size(); ++i) {
    const MeasuredOutput& measured = problem.measured[i];
    if (!measured.noise.unknown) continue;
    return InvalidField(
        "regularization_mode",
        absl::StrFormat("DISCREPANCY compares the mismatch with a noise of known size, and "
                        "measured[%d].noise (%s) is unknown; L_CURVE and EVIDENCE do without",
                        i, measured.output));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
