#include "core/estimator/problem/output_delay.h"

#include <absl/strings/str_format.h>

#include <cmath>

namespace polyest::internal {

absl::Status CheckOutputDelay(const FieldPath& field, const std::string& name, double smallest_s,
                              double largest_s) {
  if (!std::isfinite(smallest_s) || !std::isfinite(largest_s)) {
    return InvalidField(
        field, absl::StrFormat("the delay %s of an output needs bounds, since its samples before "
                               "the largest delay are not used; give it a prior between two bounds",
                               name));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
