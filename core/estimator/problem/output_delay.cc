#include "core/estimator/problem/output_delay.h"

#include <absl/strings/str_format.h>

#include <cmath>

namespace polyest::internal {

absl::Status CheckOutputDelay(const FieldPath& field, const std::string& name, double smallest_s,
                              double largest_s, bool inputs_streamed) {
  if (!std::isfinite(smallest_s) || !std::isfinite(largest_s)) {
    return InvalidField(
        field, absl::StrFormat("the delay %s of an output needs bounds, since its samples before "
                               "the largest delay are not used; give it a prior between two bounds",
                               name));
  }
  if (smallest_s < 0 && inputs_streamed) {
    return InvalidField(
        field,
        absl::StrFormat("%s may be as small as %g s; with a streamed input the delay of an output "
                        "must not be negative, since values to come would be needed; give the "
                        "inputs' values at earlier times instead",
                        name, smallest_s));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
