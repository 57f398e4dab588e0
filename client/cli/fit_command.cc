#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/csv_field.h"
#include "client/cli/data_warnings.h"
#include "client/cli/estimate_format.h"
#include "client/cli/fit_plot.h"
#include "client/cli/input_files.h"
#include "client/cli/number_format.h"
#include "client/cli/problem_input.h"
#include "client/cli/text_table.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

using Output = v1::PredictResponse::Output;

constexpr int kShownLags = 3;

absl::StatusOr<v1::PredictResponse> Fit(const FitArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(CheckPlotFile(arguments.plot_file));
  v1::PredictRequest request;
  POLYEST_ASSIGN_OR_RETURN(InputFiles files, FillSubject(arguments, *request.mutable_subject()));
  if (!arguments.validation_file.empty()) {
    POLYEST_ASSIGN_OR_RETURN(const v1::Problem problem,
                             ProblemOf(request.subject(), arguments.place));
    POLYEST_ASSIGN_OR_RETURN(const DataColumns columns,
                             DataColumnsFor(problem, arguments.place, arguments.data_options));
    POLYEST_ASSIGN_OR_RETURN(*request.mutable_record(),
                             ReadData(arguments.validation_file, columns, files.record));
    DataWarnings().Print(problem, arguments.place, request.record(), arguments.validation_file);
  }
  request.mutable_outputs()->Add(arguments.outputs.begin(), arguments.outputs.end());
  request.mutable_probabilities()->Add(arguments.probabilities.begin(),
                                       arguments.probabilities.end());
  request.set_draw_count(arguments.draws);
  request.set_max_row_count(arguments.rows);
  request.set_horizon_s(arguments.horizon_s);
  request.set_smoothed(arguments.smoothed);
  request.set_forecast_s(arguments.forecast_s);
  auto response = MakeBackend(arguments.place)->Predict(request);
  if (!response.ok()) return InFiles(response.status(), files);
  return Plotted(*std::move(response), MakePlot, arguments.plot_file);
}

std::string FormatAutocorrelation(const v1::PredictResponse::Score& score) {
  std::vector<std::string> values;
  for (int lag = 0; lag < std::min(kShownLags, score.autocorrelation_size()); ++lag) {
    values.push_back(absl::StrFormat("%.2f", score.autocorrelation(lag)));
  }
  return absl::StrJoin(values, ", ");
}

// Says how the outputs agree with the samples.
void PrintScores(const v1::PredictResponse& prediction, std::ostream& out) {
  TextTable table({"output", "samples", "rms residual", "unit", "within 95 %", "log score",
                   "autocorrelation 1, 2, 3"});
  for (const Output& output : prediction.outputs()) {
    const v1::PredictResponse::Score& score = output.score();
    if (!output.has_score() || score.sample_count() == 0) {
      table.AddRow({output.output(), "0", "-", UnitText(output.unit()), "-", "-", "-"});
      continue;
    }
    table.AddRow({output.output(), absl::StrCat(score.sample_count()),
                  FormatNumber(score.root_mean_square()), UnitText(output.unit()),
                  FormatPercent(score.coverage95()), absl::StrFormat("%.4f", score.log_score()),
                  FormatAutocorrelation(score)});
  }
  table.Print(out);
}

// Says where outputs without scores begin, how far they go and where they end.
void PrintCourses(const v1::PredictResponse& prediction, std::ostream& out) {
  TextTable table({"output", "first ± sd", "least", "greatest", "last ± sd", "unit"});
  for (const Output& output : prediction.outputs()) {
    if (output.mean().empty()) continue;
    const auto [least, greatest] = std::ranges::minmax(output.mean());
    const auto at = [&](int k) { return FormatUncertain(output.mean(k), output.std_dev(k)); };
    table.AddRow({output.output(), at(0), FormatNumber(least), FormatNumber(greatest),
                  at(output.mean_size() - 1), UnitText(output.unit())});
  }
  table.Print(out);
}

// Says which parameters that drift have changed more suddenly than they walk.
void PrintAbruptChanges(const v1::PredictResponse& prediction, std::ostream& out) {
  for (const Output& output : prediction.outputs()) {
    if (!output.has_abrupt_change()) continue;
    const v1::PredictResponse::AbruptChange& change = output.abrupt_change();
    out << absl::StrFormat(
        "%s has %s abruptly at t = %s s%s, which its random walk does not explain: score %.1f, "
        "limit %.1f\n",
        output.output(), change.score() > 0 ? "risen" : "fallen", FormatNumber(change.time_s()),
        change.run() > 0 ? absl::StrFormat(" of run %d", change.run()) : "",
        std::abs(change.score()), change.limit());
  }
}

void PrintTable(const v1::PredictResponse& prediction, std::ostream& out) {
  const bool scored = std::ranges::any_of(prediction.outputs(), &Output::has_score);
  if (scored) PrintScores(prediction, out);
  const auto has_samples = [](const Output& output) { return !output.measured_rows().empty(); };
  const bool forecasts = std::ranges::none_of(prediction.outputs(), has_samples);
  if (scored && forecasts) out << '\n';
  if (!scored || forecasts) PrintCourses(prediction, out);
  out << absl::StrFormat("\n%d rows; %d trajectories of the model at draws of the posterior%s\n",
                         prediction.row_count(), prediction.draw_count(),
                         prediction.failed_draw_count() == 0
                             ? ""
                             : absl::StrFormat(", of which %d could not be integrated to the end",
                                               prediction.failed_draw_count()));
  PrintAbruptChanges(prediction, out);
  PrintDiagnostics(prediction.diagnostics(), out);
}

void PrintHeader(const v1::PredictResponse& prediction, std::ostream& out) {
  out << "run,t";
  for (const Output& output : prediction.outputs()) {
    const auto column = [&](absl::string_view what) {
      out << ',' << CsvField(absl::StrCat(output.output(), "_", what));
    };
    column("mean");
    column("stdDev");
    for (const double p : prediction.probabilities()) column("q" + FormatExact(p));
    if (!output.sample_std_dev().empty()) {
      column("sampleStdDev");
      for (const double p : prediction.probabilities()) column("sample_q" + FormatExact(p));
    }
    for (const char* const what : {"measured", "residual", "standardizedResidual"}) column(what);
  }
  out << '\n';
}

// Prints the values of one output at time k. `sample`: the place of its next sample.
void PrintValues(const Output& output, int k, int probabilities, int& sample, std::ostream& out) {
  out << ',' << FormatExact(output.mean(k)) << ',' << FormatExact(output.std_dev(k));
  for (int i = 0; i < probabilities; ++i) {
    out << ',' << FormatExact(output.quantiles(k * probabilities + i));
  }
  if (!output.sample_std_dev().empty()) {
    out << ',' << FormatExact(output.sample_std_dev(k));
    for (int i = 0; i < probabilities; ++i) {
      out << ',' << FormatExact(output.sample_quantiles(k * probabilities + i));
    }
  }
  if (sample >= output.measured_rows_size() || output.measured_rows(sample) != k) {
    out << ",,,";
    return;
  }
  out << ',' << FormatExact(output.measured(sample)) << ',' << FormatExact(output.residual(sample))
      << ',';
  if (!output.standardized_residual().empty()) {
    out << FormatExact(output.standardized_residual(sample));
  }
  ++sample;
}

// Prints one row for each time; cells of missing samples are empty.
void PrintCsv(const v1::PredictResponse& prediction, std::ostream& out) {
  PrintHeader(prediction, out);
  std::vector<int> samples(static_cast<size_t>(prediction.outputs_size()), 0);
  for (int k = 0; k < prediction.time_s_size(); ++k) {
    out << (prediction.run().empty() ? 0 : prediction.run(k)) << ','
        << FormatExact(prediction.time_s(k));
    for (int i = 0; i < prediction.outputs_size(); ++i) {
      PrintValues(prediction.outputs(i), k, prediction.probabilities_size(),
                  samples[static_cast<size_t>(i)], out);
    }
    out << '\n';
  }
}

}  // namespace

int RunCommand(const FitArguments& arguments, std::ostream& out, std::ostream& err) {
  return PrintAnswer(Fit(arguments), arguments, PrintTable, PrintCsv, out, err);
}

}  // namespace polyest::internal
