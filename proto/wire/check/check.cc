#include "proto/wire/check/check.h"

#include <string>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/estimator/record/sample_checks.h"
#include "proto/wire/check/data_summary.h"
#include "proto/wire/check/problem_summary.h"
#include "proto/wire/convert/measurements.h"
#include "proto/wire/convert/problem.h"
#include "proto/wire/convert/wire_fields.h"

namespace polyest::internal {
namespace {

using Finding = v1::CheckProblemResponse::Finding;

void AddError(const absl::Status& refusal, v1::CheckProblemResponse& response) {
  const absl::Status named = WireFields(refusal);
  Finding& finding = *response.add_errors();
  if (const auto field = FieldOf(named)) finding.set_field(field->ToString());
  finding.set_description(std::string(SentenceOf(named)));
}

void AddWarning(std::string description, v1::CheckProblemResponse& response) {
  response.add_warnings()->set_description(std::move(description));
}

void AddRemark(std::string description, v1::CheckProblemResponse& response) {
  v1::CheckProblemResponse::Remark& remark = *response.add_summary();
  remark.set_topic("data");
  remark.set_description(std::move(description));
}

absl::Status CheckMeasurements(const ResolvedProblem& problem, const v1::Measurements& measurements,
                               const ProblemLimits& limits, v1::CheckProblemResponse& response) {
  POLYEST_RETURN_IF_ERROR(CheckRuns(limits, problem, measurements));
  POLYEST_ASSIGN_OR_RETURN(const Samples samples,
                           ToSamples(measurements, *problem.problem().model));
  POLYEST_ASSIGN_OR_RETURN(const CheckedSamples checked, SampleChecks(problem).Check(samples));
  DataSummary record = Summarize(problem, checked);
  AddRemark(std::move(record.rows), response);
  for (std::string& channel : record.channels) AddRemark(std::move(channel), response);
  for (std::string& warning : record.warnings) AddWarning(std::move(warning), response);
  return absl::OkStatus();
}

absl::Status CheckResolved(const v1::CheckProblemRequest& request, const ModelLibrary& models,
                           const ProblemLimits& limits, v1::CheckProblemResponse& response) {
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem problem,
                           ToProblem(request.problem(), models, limits));
  POLYEST_ASSIGN_OR_RETURN(const Remarks remarks, SummarizeProblem(request.problem(), problem));
  response.mutable_summary()->Add(remarks.begin(), remarks.end());
  if (request.problem().measured().empty()) {
    AddWarning(
        "the problem has no measured outputs: it can be propagated, but its parameters cannot be "
        "estimated",
        response);
  }
  if (!request.has_measurements()) return absl::OkStatus();
  return CheckMeasurements(problem, request.measurements(), limits, response);
}

}  // namespace

v1::CheckProblemResponse CheckProblem(const v1::CheckProblemRequest& request,
                                      const ModelLibrary& models, const ProblemLimits& limits) {
  v1::CheckProblemResponse response;
  for (const absl::Status& refusal : CheckProblem(request.problem(), models)) {
    AddError(refusal, response);
  }
  if (!response.errors().empty()) return response;
  const absl::Status checked = CheckResolved(request, models, limits, response);
  if (!checked.ok()) {
    response.Clear();
    AddError(checked, response);
  }
  return response;
}

}  // namespace polyest::internal
