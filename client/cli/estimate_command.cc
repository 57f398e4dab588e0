#include <utility>

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/estimate_format.h"
#include "client/cli/history_plot.h"
#include "client/cli/input_files.h"
#include "client/cli/problem_input.h"
#include "core/common/status.h"
#include "polyest/data_file.h"

namespace polyest::internal {
namespace {

constexpr int kPlottedEstimates = 50;

absl::StatusOr<v1::Estimate> Estimate(const EstimateArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(CheckPlotFile(arguments.plot_file));
  v1::ComputeEstimateRequest request;
  POLYEST_ASSIGN_OR_RETURN(const InputFiles files,
                           FillSubject(arguments, *request.mutable_subject()));
  if (!arguments.plot_file.empty()) request.set_history_point_count(kPlottedEstimates);
  auto response = MakeBackend(arguments.place)->ComputeEstimate(request);
  if (!response.ok()) return InFiles(response.status(), files);
  POLYEST_RETURN_IF_ERROR(Plotted(response->history(), MakePlot, arguments.plot_file).status());
  return std::move(*response->mutable_estimate());
}

}  // namespace

int RunCommand(const EstimateArguments& arguments, std::ostream& out, std::ostream& err) {
  return PrintAnswer(Estimate(arguments), arguments, PrintEstimate, nullptr, out, err);
}

}  // namespace polyest::internal
