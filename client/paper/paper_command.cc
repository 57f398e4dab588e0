#include "client/paper/paper_command.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include "client/paper/experiments.h"
#include "client/paper/figures.h"
#include "client/paper/report.h"
#include "client/plot/plot_file.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

absl::Status RunFigure(const std::string& figure, const PaperOptions& options, std::ostream& out) {
  POLYEST_RETURN_IF_ERROR(CheckPlotFile(options.plot_file));
  POLYEST_ASSIGN_OR_RETURN(Experiment experiment, MakeExperiment(figure));
  absl::StatusOr<ExperimentResult> result = RunExperiment(experiment, options.threads);
  if (!result.ok()) {
    // An error of a built-in experiment is not an error of the command line.
    return absl::InternalError(absl::StrCat("figure ", figure, ": ", result.status().message()));
  }
  PrintExperiment(*result, out);
  if (options.plot_file.empty()) return absl::OkStatus();
  return WritePlot(MakePlot(*result), options.plot_file);
}

int Fail(const absl::Status& status, std::ostream& err) {
  err << "polyest: " << status.message() << "\n";
  return absl::IsInvalidArgument(status) ? 2 : 1;
}

}  // namespace

int RunPaper(const PaperOptions& options, std::ostream& out, std::ostream& err) {
  if (!options.figure.empty()) {
    const absl::Status status = RunFigure(options.figure, options, out);
    return status.ok() ? 0 : Fail(status, err);
  }
  if (!options.plot_file.empty()) {
    return Fail(absl::InvalidArgumentError(absl::StrCat(
                    "--plot requires a figure: polyest paper FIGURE --plot ", options.plot_file)),
                err);
  }
  const char* separator = "";
  for (const std::string& figure : PaperFigures()) {
    out << separator;
    const absl::Status status = RunFigure(figure, options, out);
    if (!status.ok()) return Fail(status, err);
    separator = "\n";
  }
  return 0;
}

}  // namespace polyest::internal
