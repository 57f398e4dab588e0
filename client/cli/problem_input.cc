#include "client/cli/problem_input.h"

#include <absl/strings/str_cat.h>

#include "client/cpp/problem_file.h"
#include "core/common/status.h"
#include "server/convert/problem.h"

namespace polyest {

absl::StatusOr<v1::Problem> ReadCheckedProblem(const std::string& path) {
  POLYEST_ASSIGN_OR_RETURN(v1::Problem problem, ReadProblemFile(path));
  const absl::Status checked = ToProblem(problem).status();
  if (!checked.ok()) return absl::InvalidArgumentError(absl::StrCat(path, ": ", checked.message()));
  return problem;
}

}  // namespace polyest
