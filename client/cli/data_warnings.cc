#include "client/cli/data_warnings.h"

#include <absl/strings/str_cat.h>

#include <iostream>
#include <utility>

#include "client/cli/backend.h"
#include "client/cli/data_input.h"
#include "client/cli/screen.h"
#include "core/common/status.h"
#include "core/estimator/record/sample_checks.h"
#include "polyest/client.h"
#include "polyest/v1/problem_service.pb.h"
#include "proto/wire/convert/measurements.h"
#include "proto/wire/convert/problem.h"

namespace polyest::internal {
namespace {

// Asks the daemon, which alone has the model.
absl::StatusOr<std::vector<std::string>> WarningsOfDaemon(const v1::Problem& problem,
                                                          const Place& place,
                                                          const v1::Measurements& data) {
  Client client(place.server, ToClientOptions(place));
  v1::CheckProblemRequest request;
  *request.mutable_problem() = problem;
  *request.mutable_measurements() = data;
  POLYEST_ASSIGN_OR_RETURN(const v1::CheckProblemResponse response, client.CheckProblem(request));
  std::vector<std::string> warnings;
  for (const v1::CheckProblemResponse::Finding& warning : response.warnings()) {
    warnings.push_back(warning.description());
  }
  return warnings;
}

absl::StatusOr<std::vector<std::string>> Warnings(const v1::Problem& problem, const Place& place,
                                                  const v1::Measurements& data) {
  if (IsInFolder(problem.model()) && !place.server.empty()) {
    return WarningsOfDaemon(problem, place, data);
  }
  POLYEST_ASSIGN_OR_RETURN(const ModelLibrary models, OpenModels(place));
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem resolved, ToProblem(problem, models));
  POLYEST_ASSIGN_OR_RETURN(DataSummary record, SummarizeRecord(resolved, data));
  return std::move(record.warnings);
}

}  // namespace

absl::StatusOr<DataSummary> SummarizeRecord(const ResolvedProblem& problem,
                                            const v1::Measurements& data) {
  POLYEST_ASSIGN_OR_RETURN(const Samples samples, ToSamples(data, *problem.problem().model));
  POLYEST_ASSIGN_OR_RETURN(const CheckedSamples checked, SampleChecks(problem).Check(samples));
  return Summarize(problem, checked);
}

void PrintWarnings(const std::vector<std::string>& warnings, std::ostream& out) {
  for (const std::string& warning : warnings) {
    out << Paint(out, Color::kYellow, "warning:") << ' ' << warning << std::endl;
  }
}

void DataWarnings::Print(const v1::Problem& problem, const Place& place,
                         const v1::Measurements& data, const std::string& file) {
  auto warnings = Warnings(problem, place, data);
  if (!warnings.ok()) return;
  if (!file.empty()) {
    for (std::string& warning : *warnings) warning = absl::StrCat(file, ": ", warning);
  }
  std::erase_if(*warnings,
                [this](const std::string& warning) { return !printed_.insert(warning).second; });
  PrintWarnings(*warnings, std::cerr);
}

}  // namespace polyest::internal
