#pragma once

// Parses the command line into one struct for each command.

#include <cstdint>
#include <ostream>
#include <string>
#include <variant>
#include <vector>

#include "client/cli/answer_format.h"
#include "client/cli/place.h"
#include "client/cli/screen.h"
#include "client/cli/session_arguments.h"
#include "client/paper/paper_command.h"
#include "polyest/data_file.h"

namespace polyest::internal {

// A problem and its data, in files.
struct ExperimentInput {
  Place place;
  std::string problem_file;
  std::string data_file;
  DataFileOptions data_options;
};

// An experiment, or a session of a daemon in its place.
struct StudyInput : ExperimentInput {
  std::string session;  // its id; empty: none
};

struct EstimateArguments : ExperimentInput {
  std::string plot_file;  // empty: none
  Format format = Format::kTable;
};

struct ExplainArguments : StudyInput {
  bool no_remedies = false;  // whether remedies of residuals are left untried
};

struct PropagateArguments {
  Place place;
  std::string problem_file;
  double until_s = 0;
  double step_s = 0;
  int draws = 0;  // 0: the default
  Format format = Format::kTable;
};

struct CostArguments : ExperimentInput {
  std::vector<std::string> parameters;
  int grid_points = 0;  // 0: the default
  Format format = Format::kJson;
};

struct ModelsArguments {
  Place place;
  std::string name;  // empty: all
  Format format = Format::kTable;
};

struct CheckArguments {
  Place place;  // always this process
  std::string problem_file;
  std::string data_file;  // empty: none
  DataFileOptions data_options;
  Format format = Format::kTable;
};

struct InitArguments {
  Place place;             // always this process
  std::string model;       // empty: list the models
  bool equations = false;  // write a model given by its equations instead
  std::string data_file;   // whose columns the problem is for; empty: none
  DataFileOptions data_options;
  std::string output_file;  // empty: standard output
  bool force = false;       // overwrite the file
};

struct SchemaArguments {};

struct SensitivityArguments {
  Place place;
  std::string problem_file;
  double until_s = 0;
  double step_s = 0;  // 0: the default
  int draws = 0;      // 0: the default
  std::vector<std::string> outputs;
  std::string plot_file;  // empty: none
  Format format = Format::kTable;
};

struct DesignArguments {
  Place place;
  std::string problem_file;
  std::string data_file;  // empty: none
  DataFileOptions data_options;
  double until_s = 0;
  double step_s = 0;  // 0: the default
  int samples = 0;    // 0: the default
  std::vector<std::string> candidate_files;
  std::vector<std::string> outputs;
  std::string plot_file;  // empty: none
  Format format = Format::kTable;
};

struct PosteriorArguments : StudyInput {
  int samples = 0;
  std::vector<double> probabilities;  // of the quantiles; empty: the default
  std::vector<std::string> joints;    // pairs of parameters, "k,c"
  std::string plot_file;              // empty: none
  Format format = Format::kTable;
};

struct FitArguments : StudyInput {
  std::string validation_file;  // another record to predict; empty: none
  std::vector<std::string> outputs;
  std::vector<double> probabilities;  // of the quantiles; empty: the default
  int draws = 0;                      // 0: the default
  int64_t rows = 0;                   // 0: the default
  double horizon_s = 0;               // of forecasts by filters
  bool smoothed = false;              // whether filters use all samples of the run
  double forecast_s = 0;              // beyond the last row, in place of the rows
  std::string plot_file;              // empty: none
  Format format = Format::kTable;
};

// How rows are held out.
struct HoldOut {
  double fraction = 0.3;  // of all rows, the last ones
  // Filters predict each row from the samples up to so many seconds before it (horizon_s of
  // v1::PredictRequest); 0: from all samples before it.
  double horizon_s = 0;
};

struct CompareArguments {
  Place place;
  std::vector<std::string> files;  // at least two problems, then the data
  DataFileOptions data_options;
  HoldOut hold_out;
  Format format = Format::kTable;
};

struct ReportArguments : StudyInput {
  std::string output_file = "report.html";
};

struct ProfileArguments : StudyInput {
  std::vector<std::string> parameters;
  int points = 0;         // 0: the default
  std::string plot_file;  // empty: none
  Format format = Format::kTable;
};

struct RegularizationArguments : StudyInput {
  double lowest = 0;   // 0: the default
  double highest = 0;  // 0: the default
  int points = 0;      // 0: the default
  std::string plot_file;
  Format format = Format::kTable;
};

using Command =
    std::variant<EstimateArguments, StreamArguments, PropagateArguments, CostArguments,
                 ModelsArguments, CheckArguments, InitArguments, SchemaArguments,
                 SensitivityArguments, DesignArguments, PosteriorArguments, FitArguments,
                 CompareArguments, ReportArguments, ProfileArguments, RegularizationArguments,
                 ExplainArguments, ExportArguments, ImportArguments, DeleteArguments, ListArguments,
                 WatchArguments, TopArguments, BackupArguments, NodesArguments, PaperOptions>;

struct CommandLine {
  Command command;
  ColorChoice color = ColorChoice::kAuto;
};

// Returns the command, or the exit status after help, version or an error have been printed.
std::variant<CommandLine, int> ParseArguments(int argc, const char* const* argv, std::ostream& out,
                                              std::ostream& err);

}  // namespace polyest::internal
