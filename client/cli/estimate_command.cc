#include <utility>

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/estimate_format.h"
#include "client/cli/problem_input.h"
#include "core/common/status.h"
#include "polyest/data_file.h"

namespace polyest::internal {
namespace {

absl::StatusOr<v1::Estimate> Estimate(const EstimateArguments& arguments) {
  v1::ComputeEstimateRequest request;
  POLYEST_RETURN_IF_ERROR(FillInput(arguments, request));
  auto response = MakeBackend(arguments.place)->ComputeEstimate(request);
  if (!response.ok()) return InInput(response.status(), arguments);
  return std::move(*response->mutable_estimate());
}

}  // namespace

int RunCommand(const EstimateArguments& arguments, std::ostream& out, std::ostream& err) {
  return PrintAnswer(Estimate(arguments), arguments, PrintEstimate, nullptr, out, err);
}

}  // namespace polyest::internal
