#pragma once

// Warns of data that are allowed but probably not what was meant, before anything is computed.

#include <absl/status/statusor.h>

#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "core/estimator/problem/resolved_problem.h"
#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"
#include "proto/wire/check/data_summary.h"

namespace polyest::internal {

// Returns the summary of a whole record and the warnings about it. INVALID_ARGUMENT names the
// sample that is refused.
absl::StatusOr<DataSummary> SummarizeRecord(const ResolvedProblem& problem,
                                            const v1::Measurements& data);

// Prints one warning in each line.
void PrintWarnings(const std::vector<std::string>& warnings, std::ostream& out);

// Prints the warnings of `polyest check` about the data of problems to the standard error, each one
// once.
class DataWarnings {
 public:
  // Each warning names `file` unless it is empty. Prints nothing for data that are refused, which
  // the computation reports. The daemon is asked where it alone has the model.
  void Print(const v1::Problem& problem, const Place& place, const v1::Measurements& data,
             const std::string& file = "");

 private:
  std::set<std::string> printed_;
};

}  // namespace polyest::internal
