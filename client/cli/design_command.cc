#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <utility>

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/data_input.h"
#include "client/cli/data_warnings.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/input_files.h"
#include "client/cli/number_format.h"
#include "client/cli/problem_input.h"
#include "client/cli/study_plots.h"
#include "client/cli/text_table.h"
#include "core/common/field_error.h"
#include "core/common/status.h"
#include "polyest/data_file.h"
#include "polyest/problem_file.h"

namespace polyest::internal {
namespace {

using Design = v1::ComputeExperimentDesignResponse;

bool HasStreamedInput(const v1::Problem& problem) {
  return std::any_of(problem.inputs().begin(), problem.inputs().end(),
                     [](const v1::Input& input) { return input.has_streamed(); });
}

// Adds the candidates: the inputs of the problem itself, unless one of them is streamed, and those
// of the candidate files. Without candidate files, the request needs none.
absl::Status AddCandidates(const DesignArguments& arguments,
                           v1::ComputeExperimentDesignRequest& request) {
  if (arguments.candidate_files.empty()) return absl::OkStatus();
  if (!HasStreamedInput(request.subject().experiment().problem())) {
    auto& own = *request.add_candidates();
    own.set_name(arguments.problem_file);
    *own.mutable_inputs() = request.subject().experiment().problem().inputs();
  }
  for (const std::string& file : arguments.candidate_files) {
    POLYEST_ASSIGN_OR_RETURN(const v1::Problem other, ReadProblemFile(file));
    auto& candidate = *request.add_candidates();
    candidate.set_name(file);
    *candidate.mutable_inputs() = other.inputs();
  }
  return absl::OkStatus();
}

// Returns the error with the name of the file in front that it is about. A field of a candidate's
// inputs is named as in the candidate's own file.
absl::Status InInputFile(const absl::Status& status, const InputFiles& files,
                         const v1::ComputeExperimentDesignRequest& request) {
  const FieldPath field = FieldOf(status).value_or(FieldPath());
  int index = 0;
  if (!absl::IsInvalidArgument(status) || field.steps().size() < 2 ||
      field.steps()[0] != FieldStep("candidates") ||
      !absl::SimpleAtoi(field.steps()[1].text(), &index) || index >= request.candidates_size()) {
    return InFiles(status, files);
  }
  absl::string_view message = status.message();
  const std::string candidate = FieldPath{"candidates", index}.ToString() + ".";
  if (absl::StartsWith(message, candidate + "inputs")) message.remove_prefix(candidate.size());
  return absl::InvalidArgumentError(absl::StrCat(request.candidates(index).name(), ": ", message));
}

absl::StatusOr<Design> DesignExperiment(const DesignArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(CheckPlotFile(arguments.plot_file));
  v1::ComputeExperimentDesignRequest request;
  POLYEST_RETURN_IF_ERROR(CheckFilesAreNotSwapped(arguments.problem_file, arguments.data_file));
  POLYEST_ASSIGN_OR_RETURN(*request.mutable_subject()->mutable_experiment()->mutable_problem(),
                           ReadCheckedProblem(arguments.problem_file, arguments.place));
  InputFiles files{.problem = arguments.problem_file};
  if (!arguments.data_file.empty()) {
    v1::Experiment& experiment = *request.mutable_subject()->mutable_experiment();
    POLYEST_ASSIGN_OR_RETURN(
        const DataColumns columns,
        DataColumnsFor(experiment.problem(), arguments.place, arguments.data_options));
    POLYEST_ASSIGN_OR_RETURN(*experiment.mutable_measurements(),
                             ReadData(arguments.data_file, columns, files.data));
    DataWarnings().Print(experiment.problem(), arguments.place, experiment.measurements());
  }
  POLYEST_RETURN_IF_ERROR(AddCandidates(arguments, request));
  request.set_until_s(arguments.until_s);
  request.set_step_s(arguments.step_s);
  request.set_sample_count(arguments.samples);
  for (const std::string& output : arguments.outputs) request.add_possible()->set_output(output);
  auto response = MakeBackend(arguments.place)->ComputeExperimentDesign(request);
  if (!response.ok()) return InInputFile(response.status(), files, request);
  return Plotted(*std::move(response), MakePlot, arguments.plot_file);
}

// Adds the gain and the expected standard deviation of each parameter.
void AddGain(const Design::Gain& gain, std::vector<std::string>& row) {
  row.push_back(FormatNumber(gain.bits(), 3));
  for (const double sd : gain.std_dev()) row.push_back(FormatNumber(sd, 2));
}

std::vector<std::string> Header(const Design& design, std::vector<std::string> first) {
  first.push_back("bits");
  for (const auto& parameter : design.parameters()) first.push_back("sd " + parameter.name());
  return first;
}

void PrintCandidates(const Design& design, std::ostream& out) {
  TextTable table(Header(design, {"inputs"}));
  std::vector<std::string> now = {"(before the experiment)", "0"};
  for (const auto& p : design.parameters()) now.push_back(FormatNumber(p.std_dev(), 2));
  table.AddRow(std::move(now));
  for (const auto& candidate : design.candidates()) {
    std::vector<std::string> row = {candidate.name().empty() ? "the problem's" : candidate.name()};
    AddGain(candidate.gain(), row);
    table.AddRow(std::move(row));
  }
  table.Print(out);
}

void PrintOutputs(const Design& design, const Design::Candidate& candidate, std::ostream& out) {
  TextTable table(Header(design, {"output", "unit", "noise sd", "measured", "bits alone"}));
  for (const auto& output : candidate.outputs()) {
    std::vector<std::string> row = {
        output.name(), UnitText(output.unit()), FormatNumber(output.noise_std_dev(), 3),
        output.measured() ? "yes" : "no", FormatNumber(output.alone().bits(), 3)};
    AddGain(output.together(), row);
    table.AddRow(std::move(row));
  }
  table.Print(out);
}

void PrintSamples(const Design& design, const Design::Candidate& candidate, std::ostream& out) {
  TextTable table(Header(design, {"t (s)"}));
  for (const auto& sample : candidate.samples()) {
    std::vector<std::string> row = {FormatNumber(sample.time_s(), 6)};
    AddGain(sample.gain(), row);
    table.AddRow(std::move(row));
  }
  table.Print(out);
}

// Returns the names of the measured outputs; "all outputs" if none is measured.
std::string Planned(const Design::Candidate& candidate) {
  std::vector<std::string> measured;
  for (const auto& output : candidate.outputs()) {
    if (output.measured()) measured.push_back(output.name());
  }
  return measured.empty() ? "all outputs" : absl::StrJoin(measured, ", ");
}

void PrintTables(const Design& design, std::ostream& out) {
  const Design::Candidate& best = design.candidates(0);
  out << "Expected information gain, and standard deviations afterwards, of samples of "
      << Planned(best) << " at all times:\n\n";
  PrintCandidates(design, out);
  const std::string of_best =
      design.candidates_size() > 1 ? absl::StrCat(" with ", best.name()) : "";
  out << "\nEach output at all times" << of_best
      << ", alone, and together with all that is measured:\n\n";
  PrintOutputs(design, best, out);
  out << "\nThe best times for samples of " << Planned(best) << of_best
      << ", each in addition to those above it:\n\n";
  PrintSamples(design, best, out);
  out << absl::StrFormat("\nslopes of the model at %d draws, by %d trajectories\n",
                         best.draw_count(), best.trajectory_count());
  PrintDiagnostics(design.diagnostics(), out);
  PrintDiagnostics(best.diagnostics(), out);
}

// Says that there are fewer possible sample times than are to be chosen.
void TellOfFewerTimes(const Design& design, const DesignArguments& arguments, std::ostream& err) {
  const int chosen = design.candidates(0).samples_size();
  if (chosen >= arguments.samples) return;
  err << absl::StrFormat(
      "polyest: --samples: there are only %d possible sample times, all of which are chosen; a "
      "smaller --step allows more\n",
      chosen);
}

}  // namespace

int RunCommand(const DesignArguments& arguments, std::ostream& out, std::ostream& err) {
  const absl::StatusOr<Design> design = DesignExperiment(arguments);
  if (design.ok()) TellOfFewerTimes(*design, arguments, err);
  return PrintAnswer(design, arguments, PrintTables, nullptr, out, err);
}

}  // namespace polyest::internal
