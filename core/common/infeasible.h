#pragma once

// What cannot be done where it was tried, though nothing is broken: trajectories that are too few
// for an expansion, a cost that is finite almost nowhere, sums that cannot be carried over. Whoever
// asked may have another way (stay with the present expansion, propagate the record again, leave a
// component out) and asks IsInfeasible for that; everybody else passes the status on as an error.
//
// To users it is FAILED_PRECONDITION with its message. In the library the code does not tell,
// because models, stores and servers return it, too, and their errors must not be passed over.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

namespace polyest::internal {

// Returns a status of code FAILED_PRECONDITION, marked as above; `why` is a sentence for users.
absl::Status InfeasibleError(absl::string_view why);

// Whether InfeasibleError has made the status. False if it is OK.
bool IsInfeasible(const absl::Status& status);

}  // namespace polyest::internal
