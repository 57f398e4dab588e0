#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/json_format.h"
#include "client/cli/problem_input.h"
#include "core/common/status.h"
#include "polyest/data_file.h"

namespace polyest::internal {
namespace {

absl::StatusOr<v1::ComputeEstimateResponse> Estimate(const EstimateArguments& arguments) {
  v1::ComputeEstimateRequest request;
  POLYEST_RETURN_IF_ERROR(FillInput(arguments, request));
  auto response = MakeBackend(arguments.place)->ComputeEstimate(request);
  if (!response.ok()) return InInput(response.status(), arguments);
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

}  // namespace polyest::internal
