#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>
#include <utility>

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/csv_field.h"
#include "client/cli/estimate_format.h"
#include "client/cli/input_files.h"
#include "client/cli/number_format.h"
#include "client/cli/problem_input.h"
#include "client/cli/study_plots.h"
#include "client/cli/text_table.h"
#include "core/common/status.h"
#include "polyest/data_file.h"

namespace polyest::internal {
namespace {

absl::StatusOr<v1::ComputeCostProfilesResponse> Profile(const ProfileArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(CheckPlotFile(arguments.plot_file));
  v1::ComputeCostProfilesRequest request;
  POLYEST_ASSIGN_OR_RETURN(const InputFiles files,
                           FillSubject(arguments, *request.mutable_subject()));
  request.mutable_parameters()->Add(arguments.parameters.begin(), arguments.parameters.end());
  request.set_point_count(arguments.points);
  // A table needs fewer points than a plot.
  if (arguments.format == Format::kTable && arguments.points == 0 && arguments.plot_file.empty()) {
    request.set_point_count(kTablePoints);
  }
  auto response = MakeBackend(arguments.place)->ComputeCostProfiles(request);
  if (!response.ok()) return InFiles(response.status(), files);
  return Plotted(*std::move(response), MakePlot, arguments.plot_file);
}

// Returns the rise of the cost above its least value; 0 if it would be printed as 0, so that a
// rounding error does not show as "-0.000".
double Rise(double total, double least) {
  const double rise = total - least;
  return std::abs(rise) < 5e-4 ? 0 : rise;
}

// Prints one table per parameter: its values, the rise of the cost and the other parameters at the
// minimum.
void PrintTables(const v1::ComputeCostProfilesResponse& response, std::ostream& out) {
  const int columns = response.parameters_size();
  for (const auto& profile : response.profiles()) {
    const int count = profile.value_size();
    const double range = count > 0 ? profile.value(count - 1) - profile.value(0) : 0;
    std::vector<std::string> header = {NameWithUnit(profile.parameter(), profile.unit()),
                                       "cost above the least", "mismatch", "prior"};
    for (const std::string& name : response.parameters()) {
      if (name != profile.parameter()) header.push_back(name);
    }
    TextTable table(std::move(header), TextTable::Align::kRight);
    for (int k = 0; k < count; ++k) {
      std::vector<std::string> row = {
          FormatValue(profile.value(k), range / 8),
          absl::StrFormat("%.3f", Rise(profile.total(k), response.least().total())),
          FormatNumber(profile.mismatch(k), 6), FormatNumber(profile.prior(k), 4)};
      for (int j = 0; j < columns; ++j) {
        if (response.parameters(j) == profile.parameter()) continue;
        row.push_back(FormatNumber(profile.minima(k * columns + j), 6));
      }
      table.AddRow(std::move(row));
    }
    table.Print(out);
    out << '\n';
  }
  out << "A rise of 0.5 above the least cost corresponds to one standard deviation of a Gaussian "
         "posterior, a rise of 2 to two.\n";
  PrintDiagnostics(response.diagnostics(), out);
}

// Prints one row per value: the profiled parameter, its value, the costs and all parameters at the
// minimum.
void PrintCsv(const v1::ComputeCostProfilesResponse& response, std::ostream& out) {
  out << "parameter,value,total,mismatch,prior";
  for (const std::string& name : response.parameters()) out << ',' << CsvField(name);
  out << '\n';
  const int columns = response.parameters_size();
  for (const auto& profile : response.profiles()) {
    for (int k = 0; k < profile.value_size(); ++k) {
      out << CsvField(profile.parameter()) << ',' << FormatExact(profile.value(k)) << ','
          << FormatExact(profile.total(k)) << ',' << FormatExact(profile.mismatch(k)) << ','
          << FormatExact(profile.prior(k));
      for (int j = 0; j < columns; ++j) {
        out << ',' << FormatExact(profile.minima(k * columns + j));
      }
      out << '\n';
    }
  }
}

}  // namespace

int RunCommand(const ProfileArguments& arguments, std::ostream& out, std::ostream& err) {
  return PrintAnswer(Profile(arguments), arguments, PrintTables, PrintCsv, out, err);
}

}  // namespace polyest::internal
