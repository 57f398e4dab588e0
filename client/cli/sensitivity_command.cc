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
#include "client/cli/study_plots.h"
#include "client/cli/text_table.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

using Analysis = v1::ComputeSensitivityResponse;

constexpr int kMaxTableRows = 21;  // per output; the other formats have all times

absl::StatusOr<Analysis> AnalyzeSensitivity(const SensitivityArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(CheckPlotFile(arguments.plot_file));
  v1::ComputeSensitivityRequest request;
  POLYEST_ASSIGN_OR_RETURN(*request.mutable_subject()->mutable_experiment()->mutable_problem(),
                           ReadCheckedProblem(arguments.problem_file, arguments.place));
  request.set_until_s(arguments.until_s);
  request.set_step_s(arguments.step_s);
  request.set_draw_count(arguments.draws);
  request.mutable_outputs()->Add(arguments.outputs.begin(), arguments.outputs.end());
  auto response = MakeBackend(arguments.place)->ComputeSensitivity(request);
  if (!response.ok()) return InFiles(response.status(), {.problem = arguments.problem_file});
  return Plotted(*std::move(response), MakePlot, arguments.plot_file);
}

std::string Share(double share) { return absl::StrFormat("%.3f", share); }

// Returns time, mean, standard deviation, residual, and the first-order and total index of each
// parameter, which are "-" where the output does not vary.
std::vector<std::string> Row(const Analysis& analysis, const Analysis::Output& output, int k) {
  const int n = analysis.parameters_size();
  const auto totals = output.total().begin() + k * n;
  const bool varies = std::any_of(totals, totals + n, [](double share) { return share > 0; });
  const double sd = varies ? output.std_dev(k) : 0;
  std::vector<std::string> row = {FormatNumber(analysis.time_s(k), 6),
                                  FormatValue(output.mean(k), sd), FormatNumber(sd, 3),
                                  FormatNumber(varies ? output.residual(k) : 0, 2)};
  for (int i = k * n; i < (k + 1) * n; ++i) {
    row.push_back(varies ? Share(output.first_order(i)) : "-");
    row.push_back(varies ? Share(output.total(i)) : "-");
  }
  return row;
}

void PrintOutput(const Analysis& analysis, const Analysis::Output& output, std::ostream& out) {
  out << NameWithUnit(output.name(), output.unit()) << '\n';
  std::vector<std::string> header = {"t (s)", "mean", "sd", "residual"};
  for (const std::string& parameter : analysis.parameters()) {
    header.push_back(parameter);
    header.push_back("total");
  }
  TextTable table(std::move(header), TextTable::Align::kRight);
  const int times = analysis.time_s_size();
  const int stride = std::max(1, (times + kMaxTableRows - 3) / (kMaxTableRows - 1));
  for (int k = 0; k < times; k += stride) table.AddRow(Row(analysis, output, k));
  table.Print(out);
  out << '\n';
}

void PrintActivity(const Analysis& analysis, std::ostream& out) {
  TextTable table({"parameter", "share of the variance", "largest effect/noise"});
  for (const auto& activity : analysis.activity()) {
    table.AddRow(
        {activity.parameter(), Share(activity.share()), FormatNumber(activity.peak_to_noise(), 3)});
  }
  table.Print(out);
}

void PrintTables(const Analysis& analysis, std::ostream& out) {
  out << "Share of the variance due to each parameter alone, and including its interactions "
         "(total)\n\n";
  for (const auto& output : analysis.outputs()) PrintOutput(analysis, output, out);
  PrintActivity(analysis, out);
  out << absl::StrFormat("\nexpansion: order %d, %d terms, %d points\n",
                         analysis.expansion().order(), analysis.expansion().term_count(),
                         analysis.expansion().point_count());
  out << absl::StrFormat("compared with the model at %d draws of the prior\n",
                         analysis.draw_count());
  PrintDiagnostics(analysis.diagnostics(), out);
}

// Prints one row per time: x.mean, x.stdDev, x.residual, x.noise, x.first.k, x.total.k … for each
// output x and parameter k.
void PrintCsv(const Analysis& analysis, std::ostream& out) {
  out << 't';
  for (const auto& output : analysis.outputs()) {
    const auto column = [&](absl::string_view what) {
      out << ',' << CsvField(absl::StrCat(output.name(), ".", what));
    };
    for (const char* const what : {"mean", "stdDev", "residual", "noise"}) column(what);
    for (const std::string& parameter : analysis.parameters()) {
      column("first." + parameter);
      column("total." + parameter);
    }
  }
  out << '\n';
  const int n = analysis.parameters_size();
  for (int k = 0; k < analysis.time_s_size(); ++k) {
    out << FormatExact(analysis.time_s(k));
    for (const auto& output : analysis.outputs()) {
      out << ',' << FormatExact(output.mean(k)) << ',' << FormatExact(output.std_dev(k)) << ','
          << FormatExact(output.residual(k)) << ',' << FormatExact(output.noise_std_dev(k));
      for (int i = k * n; i < (k + 1) * n; ++i) {
        out << ',' << FormatExact(output.first_order(i)) << ',' << FormatExact(output.total(i));
      }
    }
    out << '\n';
  }
}

}  // namespace

int RunCommand(const SensitivityArguments& arguments, std::ostream& out, std::ostream& err) {
  return PrintAnswer(AnalyzeSensitivity(arguments), arguments, PrintTables, PrintCsv, out, err);
}

}  // namespace polyest::internal
