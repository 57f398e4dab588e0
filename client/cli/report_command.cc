#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>
#include <absl/time/time.h>

#include <utility>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "client/cli/input_files.h"
#include "client/cli/problem_input.h"
#include "client/cli/report_page.h"
#include "client/plot/output_file.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr int kHistoryPoints = 50;
constexpr int kDensityBins = 60;

// Asks for the measured outputs as they were predicted, and for what drifts as all samples tell it.
absl::Status Predict(const v1::Subject& subject, Backend& backend, ReportContent& content) {
  v1::PredictRequest predict;
  *predict.mutable_subject() = subject;
  for (const v1::MeasuredOutput& measured : content.problem.measured()) {
    predict.add_outputs(measured.output());
  }
  POLYEST_ASSIGN_OR_RETURN(content.prediction, backend.Predict(predict));
  predict.clear_outputs();
  predict.set_smoothed(true);
  for (const v1::UncertainParameter& parameter : content.problem.uncertain()) {
    if (parameter.has_drift()) predict.add_outputs(parameter.name());
  }
  if (predict.outputs().empty()) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(content.drift, backend.Predict(predict));
  return absl::OkStatus();
}

// Computes what the report shows.
absl::Status Compute(const v1::Subject& subject, Backend& backend, ReportContent& content) {
  v1::ComputeEstimateRequest estimate;
  *estimate.mutable_subject() = subject;
  estimate.set_history_point_count(kHistoryPoints);
  POLYEST_ASSIGN_OR_RETURN(v1::ComputeEstimateResponse estimated,
                           backend.ComputeEstimate(estimate));
  content.estimate = std::move(*estimated.mutable_estimate());
  content.history = std::move(*estimated.mutable_history());
  POLYEST_RETURN_IF_ERROR(Predict(subject, backend, content));
  v1::ComputePosteriorRequest posterior;
  *posterior.mutable_subject() = subject;
  posterior.set_all_joints(true);
  posterior.set_density_bin_count(kDensityBins);
  POLYEST_ASSIGN_OR_RETURN(content.posterior, backend.ComputePosterior(posterior));
  return absl::OkStatus();
}

absl::Status MakeReport(const ReportArguments& arguments) {
  POLYEST_RETURN_IF_ERROR(CheckOutputFile("--output", arguments.output_file));
  v1::Subject subject;
  POLYEST_ASSIGN_OR_RETURN(const InputFiles files, FillSubject(arguments, subject));
  ReportContent content;
  content.subject = arguments.session.empty()
                        ? absl::StrCat(arguments.problem_file, ", ", arguments.data_file)
                        : absl::StrCat("session ", arguments.session);
  POLYEST_ASSIGN_OR_RETURN(content.problem, ProblemOf(subject, arguments.place));
  content.date = absl::FormatTime("%Y-%m-%d %H:%M UTC", absl::Now(), absl::UTCTimeZone());
  content.version = POLYEST_VERSION;
  const auto backend = MakeBackend(arguments.place);
  const absl::Status computed = Compute(subject, *backend, content);
  if (!computed.ok()) return InFiles(computed, files);
  return WriteOutputFile("--output", arguments.output_file, ReportPage(content));
}

}  // namespace

int RunCommand(const ReportArguments& arguments, std::ostream& out, std::ostream& err) {
  const absl::Status status = MakeReport(arguments);
  if (!status.ok()) return Report(status, arguments.place.server, err);
  out << arguments.output_file << '\n';
  return kExitOk;
}

}  // namespace polyest::internal
