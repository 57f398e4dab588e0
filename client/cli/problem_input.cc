#include "client/cli/problem_input.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "client/cli/backend.h"
#include "client/cpp/file_kind.h"
#include "core/common/status.h"
#include "polyest/client.h"
#include "polyest/problem_file.h"
#include "proto/wire/convert/problem.h"

namespace polyest::internal {

absl::StatusOr<v1::Problem> ReadCheckedProblem(const std::string& path, const Place& place) {
  POLYEST_ASSIGN_OR_RETURN(v1::Problem problem, ReadProblemFile(path));
  if (IsInFolder(problem.model()) && !place.server.empty()) return problem;
  POLYEST_ASSIGN_OR_RETURN(const ModelLibrary models, OpenModels(place));
  const absl::Status checked = ToProblem(problem, models).status();
  if (!checked.ok()) return absl::InvalidArgumentError(absl::StrCat(path, ": ", checked.message()));
  return problem;
}

absl::Status CheckFilesAreNotSwapped(const std::string& problem_file,
                                     const std::string& data_file) {
  if (KindOfFile(problem_file) != FileKind::kCsv || KindOfFile(data_file) != FileKind::kJson) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("the first file, ", problem_file,
                                                 ", is CSV data and the second, ", data_file,
                                                 ", a problem: swap them"));
}

absl::StatusOr<InputFiles> ReadProblemAndData(const ExperimentInput& input,
                                              v1::Experiment& experiment, DataWarnings& warnings) {
  POLYEST_RETURN_IF_ERROR(CheckFilesAreNotSwapped(input.problem_file, input.data_file));
  InputFiles files{.problem = input.problem_file};
  v1::Problem& problem = *experiment.mutable_problem();
  POLYEST_ASSIGN_OR_RETURN(problem, ReadCheckedProblem(input.problem_file, input.place));
  POLYEST_ASSIGN_OR_RETURN(const DataColumns columns,
                           DataColumnsFor(problem, input.place, input.data_options));
  POLYEST_ASSIGN_OR_RETURN(*experiment.mutable_measurements(),
                           ReadData(input.data_file, columns, files.data));
  warnings.Print(problem, input.place, experiment.measurements());
  return files;
}

absl::StatusOr<InputFiles> FillSubject(const ExperimentInput& input, v1::Subject& subject) {
  DataWarnings warnings;
  return ReadProblemAndData(input, *subject.mutable_experiment(), warnings);
}

absl::StatusOr<InputFiles> FillSubject(const StudyInput& input, v1::Subject& subject) {
  const ExperimentInput& experiment = input;
  if (input.session.empty()) return FillSubject(experiment, subject);
  subject.set_session(absl::StrCat("sessions/", input.session));
  return InputFiles();
}

absl::StatusOr<v1::Problem> ProblemOf(const v1::Subject& subject, const Place& place) {
  if (subject.has_experiment()) return subject.experiment().problem();
  Client client(place.server, ToClientOptions(place));
  v1::GetSessionRequest get;
  get.set_name(subject.session());
  POLYEST_ASSIGN_OR_RETURN(v1::Session session, client.GetSession(get));
  return std::move(*session.mutable_problem());
}

}  // namespace polyest::internal
