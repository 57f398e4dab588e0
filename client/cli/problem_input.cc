#include "client/cli/problem_input.h"

#include <absl/strings/str_cat.h>

#include "client/cli/backend.h"
#include "client/cpp/problem_file.h"
#include "core/common/status.h"
#include "server/convert/problem.h"

namespace polyest {

absl::StatusOr<v1::Problem> ReadCheckedProblem(const std::string& path, const Place& place) {
  POLYEST_ASSIGN_OR_RETURN(v1::Problem problem, ReadProblemFile(path));
  if (problem.model().has_fmu() && !place.server.empty()) return problem;
  POLYEST_ASSIGN_OR_RETURN(const ModelLibrary models, OpenModels(place));
  const absl::Status checked = ToProblem(problem, models).status();
  if (!checked.ok()) return absl::InvalidArgumentError(absl::StrCat(path, ": ", checked.message()));
  return problem;
}

}  // namespace polyest
