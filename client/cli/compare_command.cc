#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <utility>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/csv_field.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/input_files.h"
#include "client/cli/model_comparison.h"
#include "client/cli/number_format.h"
#include "client/cli/problem_input.h"
#include "client/cli/text_table.h"
#include "core/common/status.h"
#include "proto/wire/convert/problem.h"

namespace polyest::internal {
namespace {

// One of the problems, and what speaks for it.
struct Contestant : Assessment {
  std::string file;
};

// Refuses a population: each run is integrated out when it ends, so that the problem has no
// evidence, and held-out rows of several runs are not predicted at once.
absl::Status CheckWithoutPopulation(const v1::Problem& problem, const std::string& file) {
  for (int i = 0; i < problem.uncertain_size(); ++i) {
    if (!problem.uncertain(i).population()) continue;
    return absl::InvalidArgumentError(absl::StrFormat(
        "%s: uncertain[%d].population: must be left out in a comparison, since a population has "
        "neither evidence nor a score of held-out rows; fit --validate judges it by other data",
        file, i));
  }
  return absl::OkStatus();
}

absl::StatusOr<Contestant> Assess(const std::string& file, const CompareArguments& arguments,
                                  Backend& backend, DataWarnings& warnings) {
  v1::Experiment experiment;
  const ExperimentInput input{arguments.place, file, arguments.files.back(),
                              arguments.data_options};
  POLYEST_ASSIGN_OR_RETURN(InputFiles files, ReadProblemAndData(input, experiment, warnings));
  POLYEST_RETURN_IF_ERROR(CheckWithoutPopulation(experiment.problem(), file));
  files.record = files.data;  // some rows of which are held out
  auto weighed = Weigh(experiment, backend);
  if (!weighed.ok()) return InFiles(weighed.status(), files);
  Contestant contestant{*std::move(weighed), file};
  const absl::Status scored = Score(experiment, arguments.hold_out, backend, contestant);
  if (!scored.ok()) return InFiles(scored, files);
  return contestant;
}

// Refuses a horizon if no problem has a filter, whose predictions alone it changes.
absl::Status CheckHorizon(const CompareArguments& arguments) {
  if (arguments.hold_out.horizon_s == 0) return absl::OkStatus();
  for (auto file = arguments.files.begin(); file + 1 != arguments.files.end(); ++file) {
    POLYEST_ASSIGN_OR_RETURN(const v1::Problem problem, ReadCheckedProblem(*file, arguments.place));
    if (UsesFilters(problem)) return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrFormat("--horizon: %g must be left out, since none of the problems has process "
                      "noise or drift, for which alone later samples change predictions",
                      arguments.hold_out.horizon_s));
}

absl::StatusOr<std::vector<Contestant>> Compare(const CompareArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(CheckHorizon(arguments));
  const auto backend = MakeBackend(arguments.place);
  std::vector<Contestant> all;
  DataWarnings warnings;
  for (auto file = arguments.files.begin(); file + 1 != arguments.files.end(); ++file) {
    POLYEST_ASSIGN_OR_RETURN(Contestant one, Assess(*file, arguments, *backend, warnings));
    all.push_back(std::move(one));
    const Contestant& first = all.front();
    const Contestant& last = all.back();
    if (first.values == last.values && first.held_out == last.held_out) continue;
    return absl::InvalidArgumentError(absl::StrFormat(
        "%s measures %d values, of which %d are held out, and %s %d and %d: problems can be "
        "compared only if they measure the same samples",
        first.file, first.values, first.held_out, last.file, last.values, last.held_out));
  }
  const bool comparable = std::ranges::all_of(
      all, [&](const Contestant& one) { return HaveComparableEvidence(one, all.front()); });
  if (!comparable) {
    for (Contestant& one : all) one.log_evidence.reset();
  }
  std::ranges::stable_sort(all, std::greater(), [](const Contestant& one) {
    return one.log_evidence.value_or(one.log_score);
  });
  return all;
}

const Contestant& BestScore(const std::vector<Contestant>& all) {
  return *std::ranges::max_element(all, {}, &Contestant::log_score);
}

// Names the warnings of the estimate from all rows, and those that the score suffers from.
std::string Warnings(const Contestant& contestant) {
  std::vector<std::string> warnings;
  for (const v1::Diagnostic& diagnostic : contestant.posterior.diagnostics()) {
    warnings.push_back(v1::Diagnostic::Code_Name(diagnostic.code()));
  }
  for (const v1::Diagnostic::Code code : contestant.doubts) {
    warnings.push_back(absl::StrCat("score: ", v1::Diagnostic::Code_Name(code)));
  }
  return absl::StrJoin(warnings, ", ");
}

void PrintTable(const std::vector<Contestant>& all, std::ostream& out) {
  TextTable table({"problem", "log evidence", "below best", "log score", "below best",
                   "within 95 %", "warnings"});
  const Contestant& scored = BestScore(all);
  const bool weighed = all.front().log_evidence.has_value();
  for (const Contestant& one : all) {
    table.AddRow(
        {one.file, weighed ? absl::StrFormat("%.2f", *one.log_evidence) : "-",
         weighed ? absl::StrFormat("%.2f", *all.front().log_evidence - *one.log_evidence) : "-",
         absl::StrFormat("%.2f", one.log_score),
         absl::StrFormat("%.2f", scored.log_score - one.log_score), FormatPercent(Coverage(one)),
         Warnings(one)});
  }
  table.Print(out);
  const std::string judged =
      absl::StrFormat("%d samples, %d of them held out", all.front().values, all.front().held_out);
  if (!weighed) {
    out << absl::StrFormat(
        "\n%s. The held-out samples prefer %s. Evidence is compared only where each problem has "
        "one (α² = 1, and a density of outliers known at the estimate) and noise of unknown size "
        "is in the same outputs.\n",
        judged, scored.file);
  } else if (&scored == &all.front()) {
    out << absl::StrFormat("\n%s. Evidence and held-out samples prefer %s.\n", judged, scored.file);
  } else {
    out << absl::StrFormat("\n%s. The evidence prefers %s, the held-out samples %s.\n", judged,
                           all.front().file, scored.file);
  }
}

void PrintCsv(const std::vector<Contestant>& all, std::ostream& out) {
  out << "problem,logEvidence,logScore,heldOut,coverage95,warnings\n";
  for (const Contestant& one : all) {
    out << CsvField(one.file) << ',' << (one.log_evidence ? FormatExact(*one.log_evidence) : "")
        << ',' << FormatExact(one.log_score) << ',' << one.held_out << ','
        << (one.held_out > 0 ? FormatExact(Coverage(one)) : "") << ',' << CsvField(Warnings(one))
        << '\n';
  }
}

}  // namespace

int RunCommand(const CompareArguments& arguments, std::ostream& out, std::ostream& err) {
  const auto compared = Compare(arguments);
  if (!compared.ok()) return Report(compared.status(), arguments.place.server, err);
  (arguments.format == Format::kCsv ? PrintCsv : PrintTable)(*compared, out);
  return kExitOk;
}

}  // namespace polyest::internal
