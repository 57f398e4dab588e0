#include "core/common/infeasible.h"

#include <absl/strings/cord.h>

namespace polyest::internal {
namespace {

constexpr char kInfeasible[] = "polyest/infeasible";  // the name of the status's payload

}  // namespace

absl::Status InfeasibleError(absl::string_view why) {
  absl::Status status = absl::FailedPreconditionError(why);
  status.SetPayload(kInfeasible, absl::Cord());
  return status;
}

bool IsInfeasible(const absl::Status& status) { return status.GetPayload(kInfeasible).has_value(); }

}  // namespace polyest::internal
