// Adds the commands that estimate from measurements and those that study an estimate.

#include <absl/strings/str_cat.h>

#include <charconv>
#include <memory>
#include <string>

#include "client/cli/command_registry.h"
#include "client/cli/shared_options.h"

namespace polyest::internal {
namespace {

constexpr size_t kMaxCompared = 19;  // problems

// One point spans no axis, which a range from 0 would allow.
std::string CheckGridPoints(const std::string& text) {
  int points = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), points);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  if (whole && (points == 0 || (points >= 2 && points <= 1001))) return "";
  return text + " must be 0 or 2 to 1001";
}

void AddEstimate(CommandRegistry& registry) {
  const auto arguments = std::make_shared<EstimateArguments>();
  CLI::App& command = registry.Add(
      {.name = "estimate",
       .summary = "Estimate from a data file",
       .examples = {"estimate problem.json data.csv",
                    "estimate problem.json data.csv --server rig:50051 --format json"}},
      arguments);
  AddProblem(command, arguments->problem_file);
  AddData(command, arguments->data_file);
  AddDataOptions(command, arguments->data_options);
  AddPlace(command, arguments->place);
  AddPlot(command, arguments->plot_file, "how the estimate came about");
  AddFormat(command, arguments->format, {"table", "json"});
}

void AddExplain(CommandRegistry& registry) {
  const auto arguments = std::make_shared<ExplainArguments>();
  CLI::App& command = registry.Add(
      {.name = "explain",
       .summary =
           "Explain which parameters the data identify, which they do not, and what would help",
       .examples = {"explain problem.json data.csv", "explain --session rig-1 --server rig:50051"},
       .notes =
           "Where residuals contradict the problem, remedies are tried on the record: correlated\n"
           "or larger noise of the sensors, process noise and drift. Each takes several estimates\n"
           "by filters, which may take a minute or more."},
      arguments);
  AddStudyInput(command, *arguments);
  command.add_flag("--no-remedies", arguments->no_remedies,
                   "Do not try remedies where residuals contradict the problem");
}

void AddPosterior(CommandRegistry& registry) {
  const auto arguments = std::make_shared<PosteriorArguments>();
  CLI::App& command = registry.Add(
      {.name = "posterior",
       .summary = "The posterior in detail: densities, quantiles and samples",
       .examples = {"posterior problem.json data.csv --quantiles 0.05,0.5,0.95",
                    "posterior problem.json data.csv --samples 1000 --format csv > samples.csv",
                    "posterior --session rig-1 --server rig:50051 --joint k,c --format csv"},
       .notes = "As csv: the samples if --samples is given, else the joint densities if --joint\n"
                "is, else one row a parameter. The densities of single parameters are in json."},
      arguments);
  AddStudyInput(command, *arguments);
  command.add_option("--samples", arguments->samples, "Samples of the posterior to print")
      ->check(WholeBetween(0, 100'000));
  command
      .add_option("--quantiles", arguments->probabilities,
                  "Probabilities of the quantiles, P,P,… (default 0.025,0.5,0.975)")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      .add_option("--joint", arguments->joints,
                  "Two parameters whose joint density is wanted, NAME,NAME; may be repeated;\n"
                  "a comma within brackets is part of a name, as in K[1,1]")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  AddPlot(command, arguments->plot_file, "the densities of parameters and pairs");
  AddFormat(command, arguments->format, {"table", "json", "csv"});
}

// Adds the options that say from which samples, and where, the outputs are predicted.
void AddTimesOfFit(CLI::App& command, FitArguments& arguments) {
  command
      .add_option(
          "--horizon", arguments.horizon_s,
          "With process noise or drift: use no sample of the last S seconds, in windows of\n"
          "that length (default 0: predict each row from all rows before it)")
      ->type_name("S")
      ->check(Between(0.0, 1e9));
  command.add_flag(
      "--smoothed", arguments.smoothed,
      "With process noise or drift: use all samples of the run for each row, also later ones;\n"
      "shows the past values of parameters that drift");
  command
      .add_option("--forecast", arguments.forecast_s,
                  "Predict so many seconds beyond the last row, in place of the rows")
      ->type_name("S")
      ->check(Between(0.0, 1e9));
}

void AddFit(CommandRegistry& registry) {
  const auto arguments = std::make_shared<FitArguments>();
  CLI::App& command = registry.Add(
      {.name = "fit",
       .summary = "The model against the measurements: bands, residuals, scores",
       .examples = {"fit problem.json data.csv --plot fit.svg",
                    "fit problem.json data.csv --validate other.csv",
                    "fit --session rig-1 --server rig:50051 --format csv > fit.csv"},
       .notes =
           "Trajectories of the model are computed at draws of the posterior. The log score is\n"
           "the mean logarithm of the predictive density at the samples: the higher, the\n"
           "better."},
      arguments);
  AddStudyInput(command, *arguments);
  command.add_option(kValidate, arguments->validation_file,
                     "Predict and score this CSV file, whose samples are not used to estimate");
  AddOutputs(command, arguments->outputs,
             "Outputs to predict, and parameters that drift, comma-separated (default: the\n"
             "measured outputs and what drifts)");
  command
      .add_option("--quantiles", arguments->probabilities,
                  "Probabilities of the quantiles, P,P,… (default 0.025,0.5,0.975)")
      ->delimiter(',')
      ->allow_extra_args(false);
  command.add_option("--draws", arguments->draws, "Trajectories of the model (default 400)")
      ->check(WholeBetween(2, 10'000));
  command.add_option("--rows", arguments->rows, "The most rows to print (default 2000)")
      ->check(WholeBetween(1, 1'000'000));
  AddTimesOfFit(command, *arguments);
  AddPlot(command, arguments->plot_file, "the fit");
  AddFormat(command, arguments->format, {"table", "json", "csv"});
}

void AddCompare(CommandRegistry& registry) {
  const auto arguments = std::make_shared<CompareArguments>();
  CLI::App& command = registry.Add(
      {.name = "compare",
       .summary = "Which of several problems explains the data best",
       .examples = {"compare linear.json cubic.json data.csv",
                    "compare white.json correlated.json data.csv --hold-out 0.5",
                    "compare perfect.json filtered.json data.csv --horizon 10"},
       .notes =
           "The evidence is the probability that a problem gives to all samples before it has\n"
           "seen them; a difference of 3 in its logarithm means odds of 20 to 1. The score is the\n"
           "log probability of the last rows, predicted by an estimate from the rows before.\n"
           "Filters go on reading samples meanwhile, so that they win a few rows ahead; ask for\n"
           "the --horizon that you need. Problems must measure the same samples, with noise of\n"
           "unknown size in the same outputs or in none."},
      arguments);
  command.add_option("files", arguments->files, "Two to 19 problem files, then the data file")
      ->option_text("PROBLEM PROBLEM… DATA REQUIRED")
      ->required()
      ->expected(3, CLI::detail::expected_max_vector_size);
  command.callback([arguments] {
    const size_t problems = arguments->files.size() - 1;
    if (problems <= kMaxCompared) return;
    throw CLI::ValidationError("files",
                               absl::StrCat(problems, " problems are more than ", kMaxCompared));
  });
  AddDataOptions(command, arguments->data_options);
  command
      .add_option("--hold-out", arguments->hold_out.fraction,
                  "Fraction of the rows to predict, the last ones (default 0.3)")
      ->check(Between(0.01, 0.99));
  command
      .add_option("--horizon", arguments->hold_out.horizon_s,
                  "With process noise or drift: predict so many seconds ahead, as fit does\n"
                  "(default 0: predict each row from all rows before it)")
      ->type_name("S")
      ->check(Between(0.0, 1e9));
  AddPlace(command, arguments->place);
  AddFormat(command, arguments->format, {"table", "csv"});
}

void AddReport(CommandRegistry& registry) {
  const auto arguments = std::make_shared<ReportArguments>();
  CLI::App& command = registry.Add(
      {.name = "report",
       .summary = "Write a report: estimates, fit, history, posterior, warnings in one HTML file",
       .examples = {"report problem.json data.csv -o report.html",
                    "report --session rig-1 --server rig:50051 -o report.html"}},
      arguments);
  AddStudyInput(command, *arguments);
  command.add_option("-o,--output", arguments->output_file, "The file (default: report.html)");
}

void AddProfile(CommandRegistry& registry) {
  const auto arguments = std::make_shared<ProfileArguments>();
  CLI::App& command = registry.Add(
      {.name = "profile",
       .summary = "The cost over each parameter, minimized over all the others",
       .examples = {"profile problem.json data.csv --parameter k",
                    "profile --session rig-1 --server rig:50051 --format csv"},
       .notes = "Computed on the expansion, up to four posterior standard deviations to each side\n"
                "of the minimum, within the prior and the region in which the expansion is\n"
                "accurate."},
      arguments);
  AddStudyInput(command, *arguments);
  command
      .add_option("--parameter", arguments->parameters,
                  "A parameter to profile; may be repeated (default: all)")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  command.add_option("--points", arguments->points, "Values of each parameter (default 41)")
      ->check(WholeBetween(3, 1'001));
  AddPlot(command, arguments->plot_file, "the profiles");
  AddFormat(command, arguments->format, {"table", "json", "csv"});
}

void AddCost(CommandRegistry& registry) {
  const auto arguments = std::make_shared<CostArguments>();
  CLI::App& command =
      registry.Add({.name = "cost",
                    .summary = "The cost over one or two uncertain parameters",
                    .examples = {"cost problem.json data.csv --parameter k --format csv"}},
                   arguments);
  AddProblem(command, arguments->problem_file);
  AddData(command, arguments->data_file);
  AddDataOptions(command, arguments->data_options);
  command
      .add_option("--parameter", arguments->parameters,
                  "A parameter to vary, at most two (default: the first two)")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  command
      .add_option("--grid", arguments->grid_points,
                  "Points per axis: 0 (default) or 2 to 1001; 0 stands for 201 with one parameter "
                  "and for 41 with two")
      ->check(CLI::Validator(CheckGridPoints, ""));
  AddPlace(command, arguments->place);
  AddFormat(command, arguments->format, {"json", "csv"});
}

void AddRegularization(CommandRegistry& registry) {
  const auto arguments = std::make_shared<RegularizationArguments>();
  CLI::App& command = registry.Add(
      {.name = "regularization",
       .summary = "The estimate over the weight α² of the prior, and which α² to choose",
       .examples = {"regularization problem.json data.csv --plot sweep.svg",
                    "regularization --session rig-1 --server rig:50051"},
       .notes =
           "Computed on the expansion around the posterior for α² = 1. Values of α² that move\n"
           "the estimate out of the region in which the expansion is accurate are left out.\n"
           "The rules choose α² from 1e-4 … 1e4."},
      arguments);
  AddStudyInput(command, *arguments);
  command.add_option("--lowest", arguments->lowest, "The least α² (default 1e-4)")
      ->check(Between(1e-8, 1e8));
  command.add_option("--highest", arguments->highest, "The greatest α² (default 1e4)")
      ->check(Between(1e-8, 1e8));
  command.add_option("--points", arguments->points, "Values of α² (default 33)")
      ->check(WholeBetween(2, 1'001));
  AddPlot(command, arguments->plot_file, "the sweep");
  AddFormat(command, arguments->format, {"table", "json", "csv"});
}

}  // namespace

void AddEstimationCommands(CommandRegistry& registry) {
  registry.StartGroup("Estimate");
  AddEstimate(registry);
  AddExplain(registry);
  AddPosterior(registry);
  AddFit(registry);
  AddCompare(registry);
  AddReport(registry);
  AddProfile(registry);
  AddCost(registry);
  AddRegularization(registry);
}

}  // namespace polyest::internal
