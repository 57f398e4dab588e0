#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/json_format.h"
#include "client/cli/problem_input.h"
#include "client/cpp/data_file.h"
#include "core/common/status.h"

namespace polyest {
namespace {

absl::StatusOr<v1::EstimateResponse> Estimate(const EstimateArguments& arguments) {
  v1::EstimateRequest request;
  POLYEST_ASSIGN_OR_RETURN(*request.mutable_problem(),
                           ReadCheckedProblem(arguments.problem_file, arguments.place));
  POLYEST_ASSIGN_OR_RETURN(*request.mutable_measurements(),
                           ReadDataFile(arguments.data_file, ColumnsOf(request.problem())));
  auto response = MakeBackend(arguments.place)->Estimate(request);
  if (!response.ok()) {
    return InFile(response.status(), arguments.problem_file, arguments.data_file);
  }
  return response;
}

}  // namespace

int RunCommand(const EstimateArguments& arguments, std::ostream& out, std::ostream& err) {
  const auto response = Estimate(arguments);
  if (!response.ok()) return Report(response.status(), arguments.place.server, err);
  if (arguments.format == Format::kJson) {
    out << ToJson(response->estimate(), /*several_lines=*/true) << '\n';
  } else {
    PrintEstimate(response->estimate(), out);
  }
  return kExitOk;
}

}  // namespace polyest
