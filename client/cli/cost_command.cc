#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/csv_field.h"
#include "client/cli/input_files.h"
#include "client/cli/number_format.h"
#include "client/cli/problem_input.h"
#include "core/common/status.h"
#include "polyest/data_file.h"

namespace polyest::internal {
namespace {

absl::StatusOr<v1::ComputeCostGridResponse> EvaluateCost(const CostArguments& arguments) {
  v1::ComputeCostGridRequest request;
  POLYEST_ASSIGN_OR_RETURN(const InputFiles files,
                           FillSubject(arguments, *request.mutable_subject()));
  request.mutable_parameters()->Add(arguments.parameters.begin(), arguments.parameters.end());
  request.set_point_count(arguments.grid_points);
  auto response = MakeBackend(arguments.place)->ComputeCostGrid(request);
  if (!response.ok()) return InFiles(response.status(), files);
  return response;
}

// Prints one row per point of the grid: its coordinates and the three costs.
void PrintCsv(const v1::ComputeCostGridResponse& cost, std::ostream& out) {
  for (const auto& axis : cost.axes()) out << CsvField(axis.parameter()) << ',';
  out << "mismatch,prior,total\n";
  const int inner = cost.axes_size() == 2 ? cost.axes(1).value_size() : 1;
  for (int i = 0; i < cost.total_size(); ++i) {
    out << FormatExact(cost.axes(0).value(i / inner)) << ',';
    if (cost.axes_size() == 2) out << FormatExact(cost.axes(1).value(i % inner)) << ',';
    out << FormatExact(cost.mismatch(i)) << ',' << FormatExact(cost.prior(i)) << ','
        << FormatExact(cost.total(i)) << '\n';
  }
}

}  // namespace

int RunCommand(const CostArguments& arguments, std::ostream& out, std::ostream& err) {
  return PrintAnswer(EvaluateCost(arguments), arguments, nullptr, PrintCsv, out, err);
}

}  // namespace polyest::internal
