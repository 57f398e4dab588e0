#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/explain_input.h"
#include "client/cli/input_files.h"
#include "client/cli/number_format.h"
#include "client/cli/problem_input.h"
#include "client/cli/remedy_report.h"
#include "client/cli/remedy_trial.h"
#include "client/cli/screen.h"
#include "core/common/status.h"
#include "polyest/data_file.h"

namespace polyest::internal {
namespace {

using Design = v1::ComputeExperimentDesignResponse;

// A remedy is proposed if the expected standard deviation is below this part of the prior's.
constexpr double kHelps = 0.5;
constexpr int kMaxTimes = 400;

bool Has(const v1::Estimate& estimate, v1::Diagnostic::Code code) {
  return std::ranges::any_of(estimate.diagnostics(), [&](const v1::Diagnostic& diagnostic) {
    return diagnostic.code() == code;
  });
}

// Whether the data allow several separate values of a parameter, so that each is known better than
// which of them is true.
bool IsInPieces(const v1::Estimate& estimate, const v1::ParameterEstimate& p) {
  return Has(estimate, v1::Diagnostic::MULTIPLE_MINIMA) &&
         p.verdict() == v1::Identifiability::WEAK && p.posterior_std_dev() >= 2 * p.std_dev();
}

std::string DescribePieces(const v1::ParameterEstimate& p, absl::string_view verdict,
                           const std::string& unit) {
  return absl::StrFormat(
      "%s is %s: several separate values fit the data. About the most probable one it is %s%s, "
      "over all of them %s%s. A prior that excludes all but one, or a measurement that tells them "
      "apart, would decide between them.",
      p.name(), verdict, FormatUncertain(p.map(), p.std_dev()), unit, EstimateText(p), unit);
}

// Returns a sentence about the information that the data give about one parameter.
std::string Describe(const v1::Estimate& estimate, const v1::ParameterEstimate& p,
                     std::ostream& out) {
  const std::string unit = p.unit().empty() || p.unit() == "1" ? "" : " " + p.unit();
  const std::string value = EstimateText(p) + unit;
  const std::string verdict = PaintVerdict(
      out, p.verdict(),
      p.verdict() == v1::Identifiability::WEAK ? "weakly identified" : VerdictText(p.verdict()));
  if (IsInPieces(estimate, p)) return DescribePieces(p, verdict, unit);
  const double narrower = p.prior_std_dev() / ShownOf(p).std_dev;
  switch (p.verdict()) {
    case v1::Identifiability::IDENTIFIED:
      return absl::StrFormat("%s is %s: %s, %.*f times narrower than your prior.", p.name(),
                             verdict, value, narrower < 10 ? 1 : 0, narrower);
    case v1::Identifiability::WEAK:
      if (narrower * kHelps > 1) {
        return absl::StrFormat(
            "%s is %s: %s, %.*f times narrower than your prior, but a warning puts that in doubt.",
            p.name(), verdict, value, narrower < 10 ? 1 : 0, narrower);
      }
      return absl::StrFormat("%s is %s: %s; the data add little to your prior, %s%s.", p.name(),
                             verdict, value, FormatUncertain(p.prior_mean(), p.prior_std_dev()),
                             unit);
    default:
      return absl::StrFormat("%s is %s: %s; the data add almost nothing to your prior, %s%s.",
                             p.name(), verdict, value,
                             FormatUncertain(p.prior_mean(), p.prior_std_dev()), unit);
  }
}

// Adds the channel's values in the first `rows` rows, with their times.
void AddKnots(const v1::Measurements& measurements, const v1::Measurements::Channel& channel,
              int rows, v1::Input::Table& table) {
  auto missing = channel.missing().begin();
  for (int row = 0; row < rows; ++row) {
    if (missing != channel.missing().end() && *missing == row) {
      ++missing;
      continue;
    }
    table.add_time_s(measurements.time_s(row));
    table.add_value(channel.values(row));
  }
}

// Returns the problem with each streamed input replaced by a table of its values in the first run,
// because the request for a design carries no data. Nothing is then read from columns of data.
v1::Problem WithoutStreamedInputs(v1::Problem problem, const v1::Measurements& measurements) {
  int rows = measurements.time_s_size();
  for (int k = 0; k < measurements.run_size() && k < rows; ++k) {
    if (measurements.run(k) != measurements.run(0)) rows = k;
  }
  for (v1::Input& input : *problem.mutable_inputs()) {
    if (!input.has_streamed()) continue;
    const v1::Input::Streamed streamed = input.streamed();
    v1::Input::Table& table = *input.mutable_table();
    table.set_hold(streamed.hold());
    if (streamed.has_amplitude()) table.set_amplitude(streamed.amplitude());
    const bool preset = streamed.interpolation() == v1::Input::INTERPOLATION_UNSPECIFIED;
    if (!streamed.hold()) {
      table.set_interpolation(preset ? v1::Input::CUBIC : streamed.interpolation());
    }
    for (const v1::Measurements::Channel& channel : measurements.channels()) {
      if (channel.name() == input.name()) AddKnots(measurements, channel, rows, table);
    }
    if (table.time_s().empty()) {
      // An input without any sample in a run is 0 there.
      table.add_time_s(0);
      table.add_value(0);
    }
  }
  problem.clear_columns();
  problem.clear_use_when();
  return problem;
}

// Returns the duration of the longest run that is known, s. The rows of a session may not have been
// read; its estimate then tells how far its last run has come.
double LongestRun(const ExplainInput& input) {
  const auto& times = input.measurements.time_s();
  const double longest = times.empty() ? 0 : *std::max_element(times.begin(), times.end());
  return std::max(longest, input.estimate.time());
}

// Returns a request about the same experiment with each further output of the model measured, and
// about the experiments with each input alone.
v1::ComputeExperimentDesignRequest Alternatives(const v1::Problem& problem, double until_s,
                                                int rows) {
  v1::ComputeExperimentDesignRequest request;
  *request.mutable_subject()->mutable_experiment()->mutable_problem() = problem;
  request.set_until_s(until_s);
  const int times = std::clamp(rows, 1, kMaxTimes);
  request.set_step_s(until_s / times);
  request.set_sample_count(1);
  request.add_candidates()->mutable_inputs()->CopyFrom(problem.inputs());
  if (problem.inputs_size() < 2) return request;
  for (const v1::Input& input : problem.inputs()) {
    auto& candidate = *request.add_candidates();
    candidate.set_name(absl::StrCat("only ", input.name()));
    *candidate.add_inputs() = input;
  }
  return request;
}

// Returns a sentence that proposes how to identify the i-th parameter, or says that no alternative
// considered would.
std::string Proposal(const Design& design, int i, const v1::ParameterEstimate& p) {
  const auto helps = [&](double sd) { return sd < kHelps * p.prior_std_dev(); };
  std::string best;
  double least = kHelps * p.prior_std_dev();
  const auto consider = [&](double sd, const std::string& what) {
    if (sd >= least) return;
    least = sd;
    best = absl::StrFormat("%s would determine %s to ±%s", what, p.name(), FormatNumber(sd, 2));
  };
  for (const Design::Candidate& candidate : design.candidates()) {
    if (!candidate.name().empty()) continue;
    if (helps(candidate.gain().std_dev(i))) {
      return absl::StrCat("According to the prior, this experiment should identify ", p.name(),
                          "; check the noise and the model.");
    }
    for (const Design::Output& output : candidate.outputs()) {
      if (output.measured()) continue;
      consider(output.together().std_dev(i),
               absl::StrCat("Measuring ", output.name(), " as well (noise ",
                            FormatNumber(output.noise_std_dev(), 2), ")"));
    }
  }
  if (!best.empty()) return best + ".";
  for (const Design::Candidate& candidate : design.candidates()) {
    if (candidate.name().empty()) continue;
    consider(candidate.gain().std_dev(i),
             absl::StrCat("Another excitation, ", candidate.name(), ","));
  }
  if (!best.empty()) return best + ".";
  return absl::StrCat(
      "No other output of the model would identify ", p.name(), " in this experiment",
      design.candidates_size() > 1 ? ", nor would any of its inputs alone" : "",
      ". Try another excitation: an input that is 0 now, other frequencies; or fix ", p.name(),
      ", or tie it to others by \"derived\".");
}

absl::StatusOr<RemedyTrial> TryOnRecord(const ExplainInput& input, Backend& backend) {
  v1::Experiment experiment;
  *experiment.mutable_problem() = input.problem;
  *experiment.mutable_measurements() = input.measurements;
  return TryRemedies(experiment, input.estimate, backend);
}

// Returns the positions of the parameters that the data leave open.
std::vector<int> OpenParameters(const ExplainInput& input) {
  std::vector<int> open;
  for (int i = 0; i < input.estimate.parameters_size(); ++i) {
    // The parameters of further runs follow those of the first; the same remedies apply to them.
    if (i >= input.problem.uncertain_size()) break;
    const v1::ParameterEstimate& p = input.estimate.parameters(i);
    const bool identified = p.verdict() == v1::Identifiability::IDENTIFIED;
    // Designs are linear: they see one piece, which is narrow already.
    if (!identified && !IsInPieces(input.estimate, p)) open.push_back(i);
  }
  return open;
}

// Prints what the data say of the parameters. `design`: for those that are open, if there is one.
void PrintExplanation(const v1::Estimate& estimate, const std::vector<int>& open,
                      const std::optional<Design>& design, std::ostream& out) {
  for (const v1::ParameterEstimate& p : estimate.parameters()) {
    PrintSentence(out, Describe(estimate, p, out));
  }
  PrintTradeOffs(estimate, out);
  PrintDiagnostics(estimate.diagnostics(), out);
  if (!design) return;
  for (const int i : open) PrintSentence(out, Proposal(*design, i, estimate.parameters(i)));
}

absl::Status Explain(const ExplainArguments& arguments, std::ostream& out) {
  auto backend = MakeBackend(arguments.place);
  POLYEST_ASSIGN_OR_RETURN(const ExplainInput input, ReadExplainInput(arguments, *backend));
  const std::vector<int> open = OpenParameters(input);
  // Without any duration there is no experiment to design; the answer then proposes none.
  std::optional<Design> design;
  if (const double until_s = LongestRun(input); !open.empty() && until_s > 0) {
    const v1::Problem problem = WithoutStreamedInputs(input.problem, input.measurements);
    auto answer = backend->ComputeExperimentDesign(Alternatives(problem, until_s, input.rows));
    if (!answer.ok()) return InFiles(answer.status(), input.files);
    design = *std::move(answer);
  }
  backend.reset();  // erases its progress line
  PrintExplanation(input.estimate, open, design, out);
  if (arguments.no_remedies || !CallsForRemedies(input.problem, input.estimate)) {
    return absl::OkStatus();
  }
  if (Has(input.estimate, v1::Diagnostic::FIXED_VALUE_CONFLICT)) {
    out << '\n';
    PrintSentence(
        out,
        "Before any remedy below, correct what the problem holds fixed and the residuals "
        "contradict, or make it uncertain, and explain again: noise and disturbances only "
        "take up what a wrong value does.");
  }
  out.flush();  // since remedies may take minutes
  backend = MakeBackend(arguments.place);
  const absl::StatusOr<RemedyTrial> trial = TryOnRecord(input, *backend);
  backend.reset();
  if (!trial.ok()) return InFiles(trial.status(), input.files);
  PrintTrial(*trial, out);
  return InFiles(trial->ended, input.files);
}

}  // namespace

int RunCommand(const ExplainArguments& arguments, std::ostream& out, std::ostream& err) {
  const absl::Status status = Explain(arguments, out);
  return status.ok() ? kExitOk : Report(status, arguments.place.server, err);
}

}  // namespace polyest::internal
