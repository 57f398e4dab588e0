#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/csv_field.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/input_files.h"
#include "client/cli/number_format.h"
#include "client/cli/problem_input.h"
#include "client/cli/regularization_plot.h"
#include "client/cli/text_table.h"
#include "client/plot/plot_file.h"
#include "core/common/status.h"
#include "polyest/data_file.h"

namespace polyest::internal {
namespace {

using Sweep = v1::ComputeRegularizationSweepResponse;

absl::StatusOr<Sweep> SweepRegularization(const RegularizationArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(CheckPlotFile(arguments.plot_file));
  v1::ComputeRegularizationSweepRequest request;
  POLYEST_ASSIGN_OR_RETURN(const InputFiles files,
                           FillSubject(arguments, *request.mutable_subject()));
  request.set_lowest(arguments.lowest);
  request.set_highest(arguments.highest);
  request.set_point_count(arguments.points);
  // A table needs fewer points than a plot.
  if (arguments.format == Format::kTable && arguments.points == 0 && arguments.plot_file.empty()) {
    request.set_point_count(kTablePoints);
  }
  auto response = MakeBackend(arguments.place)->ComputeRegularizationSweep(request);
  if (!response.ok()) return InFiles(response.status(), files);
  return Plotted(*std::move(response), MakePlot, arguments.plot_file);
}

// Formats the evidence relative to the greatest; a rounding error does not show as "-0.00".
std::string FormatLogEvidence(double value) {
  return absl::StrFormat("%.2f", value > -5e-3 ? 0 : value);
}

void PrintChoice(const char* rule, const Sweep::Choice& choice, std::ostream& out) {
  out << rule << ": ";
  if (choice.determined()) {
    out << "α² = " << FormatNumber(choice.regularization(), 3) << '\n';
  } else {
    out << "no choice: " << choice.reason() << '\n';
  }
}

void PrintTable(const Sweep& sweep, std::ostream& out) {
  std::vector<std::string> header = {"α²", "mismatch", "prior", "fitted", "log evidence"};
  for (int i = 0; i < sweep.parameters_size(); ++i) {
    header.push_back(NameWithUnit(sweep.parameters(i), sweep.units(i)));
  }
  TextTable table(std::move(header), TextTable::Align::kRight);
  for (const Sweep::Point& point : sweep.points()) {
    std::vector<std::string> row = {FormatNumber(point.regularization(), 3),
                                    FormatNumber(point.cost().mismatch(), 6),
                                    FormatNumber(point.cost().prior(), 4),
                                    absl::StrFormat("%.2f", point.effective_parameters()),
                                    FormatLogEvidence(point.log_evidence())};
    for (int i = 0; i < point.map_size(); ++i) {
      row.push_back(FormatUncertain(point.map(i), point.std_dev(i)));
    }
    table.AddRow(std::move(row));
  }
  table.Print(out);
  out << '\n';
  PrintChoice("L-curve", sweep.l_curve(), out);
  PrintChoice("discrepancy", sweep.discrepancy(), out);
  PrintChoice("evidence", sweep.evidence(), out);
  PrintDiagnostics(sweep.diagnostics(), out);
}

// Prints one row per α²: the costs, the effective parameters, the evidence, and the estimates with
// their standard deviations.
void PrintCsv(const Sweep& sweep, std::ostream& out) {
  out << "regularization,mismatch,prior,effectiveParameters,logEvidence";
  for (const std::string& name : sweep.parameters()) {
    out << ',' << CsvField(name) << ',' << CsvField(name + "_stdDev");
  }
  out << '\n';
  for (const Sweep::Point& point : sweep.points()) {
    out << FormatExact(point.regularization()) << ',' << FormatExact(point.cost().mismatch()) << ','
        << FormatExact(point.cost().prior()) << ',' << FormatExact(point.effective_parameters())
        << ',' << FormatExact(point.log_evidence());
    for (int i = 0; i < point.map_size(); ++i) {
      out << ',' << FormatExact(point.map(i)) << ',' << FormatExact(point.std_dev(i));
    }
    out << '\n';
  }
}

}  // namespace

int RunCommand(const RegularizationArguments& arguments, std::ostream& out, std::ostream& err) {
  return PrintAnswer(SweepRegularization(arguments), arguments, PrintTable, PrintCsv, out, err);
}

}  // namespace polyest::internal
