#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <utility>

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/csv_field.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/input_files.h"
#include "client/cli/number_format.h"
#include "client/cli/problem_input.h"
#include "client/cli/text_table.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

absl::StatusOr<v1::ComputePropagationResponse> Propagate(const PropagateArguments& arguments) {
  v1::ComputePropagationRequest request;
  POLYEST_ASSIGN_OR_RETURN(*request.mutable_subject()->mutable_experiment()->mutable_problem(),
                           ReadCheckedProblem(arguments.problem_file, arguments.place));
  request.set_until_s(arguments.until_s);
  request.set_step_s(arguments.step_s);
  request.set_draw_count(arguments.draws);
  auto response = MakeBackend(arguments.place)->ComputePropagation(request);
  if (!response.ok()) return InFiles(response.status(), {.problem = arguments.problem_file});
  return response;
}

// Says which numbers are those of draws of the model.
void PrintDrawn(const v1::ComputePropagationResponse& propagation, std::ostream& out) {
  out << absl::StrFormat("compared with the model at %d draws of the prior\n",
                         propagation.draw_count());
  for (const auto& output : propagation.outputs()) {
    const auto drawn = std::count(output.from_draws().begin(), output.from_draws().end(), true);
    if (drawn == 0) continue;
    out << absl::StrFormat(
        "%s: at %d of %d times the numbers are those of the draws, because the expansion does not "
        "follow the model; their residual is the standard error of the mean\n",
        output.name(), drawn, output.from_draws_size());
  }
}

// Prints one table per output.
void PrintTables(const v1::ComputePropagationResponse& propagation, std::ostream& out) {
  const int quantiles = propagation.probabilities_size();
  for (const auto& output : propagation.outputs()) {
    out << NameWithUnit(output.name(), output.unit()) << '\n';
    std::vector<std::string> header = {"t (s)", "mean", "sd"};
    for (const double probability : propagation.probabilities()) {
      header.push_back(FormatPercent(probability));
    }
    header.push_back("residual");
    TextTable table(std::move(header), TextTable::Align::kRight);
    for (int k = 0; k < propagation.time_s_size(); ++k) {
      const double sd = output.std_dev(k);
      std::vector<std::string> row = {FormatNumber(propagation.time_s(k), 6),
                                      FormatValue(output.mean(k), sd), FormatNumber(sd, 3)};
      for (int q = 0; q < quantiles; ++q) {
        row.push_back(FormatValue(output.quantiles(k * quantiles + q), sd));
      }
      row.push_back(FormatNumber(output.residual(k), 2));
      table.AddRow(std::move(row));
    }
    table.Print(out);
    out << '\n';
  }
  out << absl::StrFormat("expansion: order %d, %d terms, %d points\n",
                         propagation.expansion().order(), propagation.expansion().term_count(),
                         propagation.expansion().point_count());
  PrintDrawn(propagation, out);
  PrintDiagnostics(propagation.diagnostics(), out);
}

// Prints one row per time: x.mean, x.stdDev, x.q0.025 …, x.residual for each output x.
void PrintCsv(const v1::ComputePropagationResponse& propagation, std::ostream& out) {
  out << 't';
  for (const auto& output : propagation.outputs()) {
    const auto column = [&](absl::string_view what) {
      out << ',' << CsvField(absl::StrCat(output.name(), ".", what));
    };
    column("mean");
    column("stdDev");
    for (const double probability : propagation.probabilities()) {
      column("q" + FormatExact(probability));
    }
    column("residual");
  }
  out << '\n';
  const int quantiles = propagation.probabilities_size();
  for (int k = 0; k < propagation.time_s_size(); ++k) {
    out << FormatExact(propagation.time_s(k));
    for (const auto& output : propagation.outputs()) {
      out << ',' << FormatExact(output.mean(k)) << ',' << FormatExact(output.std_dev(k));
      for (int q = 0; q < quantiles; ++q) {
        out << ',' << FormatExact(output.quantiles(k * quantiles + q));
      }
      out << ',' << FormatExact(output.residual(k));
    }
    out << '\n';
  }
}

}  // namespace

int RunCommand(const PropagateArguments& arguments, std::ostream& out, std::ostream& err) {
  return PrintAnswer(Propagate(arguments), arguments, PrintTables, PrintCsv, out, err);
}

}  // namespace polyest::internal
