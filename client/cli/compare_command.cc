#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/held_out_rows.h"
#include "client/cli/number_format.h"
#include "client/cli/problem_input.h"
#include "client/cli/text_table.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// One of the problems, and what speaks for it.
struct Contestant {
  std::string file;
  int64_t values = 0;                   // measured, over all channels
  std::optional<double> log_evidence;   // of all samples
  std::set<std::string> unknown_noise;  // outputs whose noise has an unknown size
  int64_t held_out = 0;                 // samples
  double log_score = 0;                 // Σ log p over them
  double covered = 0;                   // of them by 95 % intervals
  v1::ComputePosteriorResponse posterior;
};

absl::Status Score(const v1::Experiment& whole, double held_out, Backend& backend,
                   Contestant& contestant) {
  const int rows = whole.measurements().time_s_size();
  const int64_t first = std::llround((1 - held_out) * rows);
  if (first < 1 || first == rows) {
    return absl::InvalidArgumentError(absl::StrFormat("--hold-out: %g of %d rows leaves none to %s",
                                                      held_out, rows,
                                                      first < 1 ? "estimate from" : "predict"));
  }
  v1::PredictRequest request;
  v1::Experiment& seen = *request.mutable_subject()->mutable_experiment();
  *seen.mutable_problem() = whole.problem();
  *seen.mutable_measurements() = FirstRows(whole.measurements(), first);
  *request.mutable_record() = WithoutFirstSamples(whole.measurements(), whole.problem(), first);
  POLYEST_ASSIGN_OR_RETURN(const v1::PredictResponse prediction, backend.Predict(request));
  for (const v1::PredictResponse::Output& output : prediction.outputs()) {
    const auto samples = static_cast<double>(output.score().sample_count());
    contestant.held_out += output.score().sample_count();
    contestant.log_score += samples * output.score().log_score();
    contestant.covered += samples * output.score().coverage95();
  }
  return absl::OkStatus();
}

absl::StatusOr<Contestant> Assess(const std::string& file, const CompareArguments& arguments,
                                  Backend& backend) {
  Contestant contestant;
  contestant.file = file;
  v1::ComputePosteriorRequest request;
  v1::Experiment& experiment = *request.mutable_subject()->mutable_experiment();
  const std::string& data = arguments.files.back();
  POLYEST_RETURN_IF_ERROR(
      ReadProblemAndData(file, data, arguments.place, *experiment.mutable_problem(),
                         *experiment.mutable_measurements(), arguments.data_options));
  auto posterior = backend.ComputePosterior(request);
  if (!posterior.ok()) return InFile(posterior.status(), file, data);
  contestant.posterior = *std::move(posterior);
  contestant.values = contestant.posterior.measured_value_count();
  if (contestant.posterior.has_log_evidence()) {
    contestant.log_evidence = contestant.posterior.log_evidence();
  }
  for (const v1::MeasuredOutput& output : experiment.problem().measured()) {
    if (output.noise().unknown()) contestant.unknown_noise.insert(output.output());
  }
  const absl::Status scored = Score(experiment, arguments.held_out, backend, contestant);
  if (!scored.ok()) return InFile(scored, file, data);
  return contestant;
}

absl::StatusOr<std::vector<Contestant>> Compare(const CompareArguments& arguments) {
  const auto backend = MakeBackend(arguments.place);
  std::vector<Contestant> all;
  for (auto file = arguments.files.begin(); file + 1 != arguments.files.end(); ++file) {
    POLYEST_ASSIGN_OR_RETURN(Contestant one, Assess(*file, arguments, *backend));
    all.push_back(std::move(one));
    const Contestant& first = all.front();
    const Contestant& last = all.back();
    if (first.values == last.values && first.held_out == last.held_out) continue;
    return absl::InvalidArgumentError(absl::StrFormat(
        "%s measures %d values, of which %d are held out, and %s %d and %d: problems can be "
        "compared only if they measure the same samples",
        first.file, first.values, first.held_out, last.file, last.values, last.held_out));
  }
  // An integral over noise of unknown size has no unit in common with a density.
  const bool comparable = std::ranges::all_of(all, [&](const Contestant& one) {
    return one.log_evidence && one.unknown_noise == all.front().unknown_noise;
  });
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

std::string Warnings(const Contestant& contestant) {
  return absl::StrJoin(contestant.posterior.diagnostics(), ", ",
                       [](std::string* text, const v1::Diagnostic& diagnostic) {
                         absl::StrAppend(text, v1::Diagnostic::Code_Name(diagnostic.code()));
                       });
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
         absl::StrFormat("%.2f", scored.log_score - one.log_score),
         FormatPercent(one.covered / static_cast<double>(std::max<int64_t>(1, one.held_out))),
         Warnings(one)});
  }
  table.Print(out);
  const std::string judged =
      absl::StrFormat("%d samples, %d of them held out", all.front().values, all.front().held_out);
  if (!weighed) {
    out << absl::StrFormat(
        "\n%s. The held-out samples prefer %s. Evidence is compared only where each problem has "
        "one (α² = 1) and noise of unknown size is in the same outputs.\n",
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
    out << one.file << ',' << (one.log_evidence ? FormatExact(*one.log_evidence) : "") << ','
        << FormatExact(one.log_score) << ',' << one.held_out << ','
        << (one.held_out > 0 ? FormatExact(one.covered / static_cast<double>(one.held_out)) : "")
        << ",\"" << Warnings(one) << "\"\n";
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
