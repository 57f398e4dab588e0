// Adds the commands for the time before measurements, and the commands `schema` and `paper`.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <memory>

#include "client/cli/command_registry.h"
#include "client/cli/shared_options.h"
#include "client/paper/experiments.h"
#include "polyest/prior_propagation.h"

namespace polyest::internal {
namespace {

constexpr char kUntilHelp[] = "No time is later, s; the last one is a multiple of --step";

void AddModels(CommandRegistry& registry) {
  const auto arguments = std::make_shared<ModelsArguments>();
  CLI::App& command = registry.Add({.name = "models",
                                    .summary = "List the available models or describe one",
                                    .examples = {"models", "models quarter_car"}},
                                   arguments);
  command.add_option("name", arguments->name, "A model's name");
  AddPlace(command, arguments->place);
  AddFormat(command, arguments->format, {"table", "json"});
}

void AddInit(CommandRegistry& registry) {
  const auto arguments = std::make_shared<InitArguments>();
  CLI::App& command = registry.Add(
      {.name = "init",
       .summary = "Write an example problem file for a model; without a model, list the models",
       .examples = {"init quarter_car -o problem.json", "init --equations -o problem.json",
                    "init --from data.csv mass_spring_damper -o problem.json"},
       .notes = "With --from and without a model, the models are listed that fit the columns."},
      arguments);
  CLI::Option* const model = command.add_option("model", arguments->model, "A model's name");
  CLI::Option* const equations =
      command.add_flag("--equations", arguments->equations, "With a model given by its equations")
          ->excludes(model);
  CLI::Option* const data =
      command
          .add_option("--from", arguments->data_file,
                      "A CSV file: the problem measures its columns, with noise of unknown size")
          ->excludes(equations);
  const auto of_data = AddDataOptions(command, arguments->data_options);
  command.callback([of_data, data] { RequireDataFile(of_data, {data}); });
  command.add_option("-o,--output", arguments->output_file, "The file (default: standard output)");
  command.add_flag("--force", arguments->force, "Overwrite the file if it is there");
  AddModelFolders(command, arguments->place);
}

void AddCheck(CommandRegistry& registry) {
  const auto arguments = std::make_shared<CheckArguments>();
  CLI::App& command =
      registry.Add({.name = "check",
                    .summary = "Check a problem, and data for it, and list all errors",
                    .examples = {"check problem.json", "check problem.json data.csv"}},
                   arguments);
  AddProblem(command, arguments->problem_file);
  const CLI::Option* const data =
      command.add_option("data", arguments->data_file, "The measurements, a CSV file");
  const auto of_data = AddDataOptions(command, arguments->data_options);
  command.callback([of_data, data] { RequireDataFile(of_data, {data}); });
  AddModelFolders(command, arguments->place);
  AddFormat(command, arguments->format, {"table", "json"});
}

void AddPriorDraws(CLI::App& command, int& draws) {
  command
      .add_option("--draws", draws,
                  absl::StrFormat("Draws of the prior at which the model itself runs (default %d)",
                                  kPriorDraws))
      ->check(WholeBetween(kMinPriorDraws, kMaxPriorDraws));
}

void AddPropagate(CommandRegistry& registry) {
  const auto arguments = std::make_shared<PropagateArguments>();
  CLI::App& command = registry.Add(
      {.name = "propagate",
       .summary = "Predict the outputs over time from the prior",
       .examples = {"propagate problem.json --until 10 --step 0.1",
                    "propagate problem.json --until 10 --step 0.01 --format csv > band.csv"}},
      arguments);
  AddProblem(command, arguments->problem_file);
  command.add_option("--until", arguments->until_s, kUntilHelp)->required();
  command.add_option("--step", arguments->step_s, "Time step, s")->required();
  AddPriorDraws(command, arguments->draws);
  AddPlace(command, arguments->place);
  AddFormat(command, arguments->format, {"table", "json", "csv"});
}

void AddSensitivity(CommandRegistry& registry) {
  const auto arguments = std::make_shared<SensitivityArguments>();
  CLI::App& command =
      registry.Add({.name = "sensitivity",
                    .summary = "Say which uncertain parameters the outputs depend on, and when",
                    .examples = {"sensitivity problem.json --until 10"}},
                   arguments);
  AddProblem(command, arguments->problem_file);
  command.add_option("--until", arguments->until_s, kUntilHelp)->required();
  command.add_option("--step", arguments->step_s, "Time step, s (default: a hundredth of --until)");
  AddPriorDraws(command, arguments->draws);
  AddOutputs(command, arguments->outputs, "The outputs, comma-separated (default: measured)");
  AddPlace(command, arguments->place);
  AddPlot(command, arguments->plot_file, "outputs and shares over time");
  AddFormat(command, arguments->format, {"table", "json", "csv"});
}

void AddDesign(CommandRegistry& registry) {
  const auto arguments = std::make_shared<DesignArguments>();
  CLI::App& command =
      registry.Add({.name = "design",
                    .summary = "Find the most informative measurements for the next experiment",
                    .examples = {"design problem.json --until 10 --samples 20",
                                 "design problem.json data.csv --until 10 --candidate chirp.json"}},
                   arguments);
  AddProblem(command, arguments->problem_file);
  const CLI::Option* const data =
      command.add_option("data", arguments->data_file, "What has been measured so far, a CSV file");
  const auto of_data = AddDataOptions(command, arguments->data_options);
  command.callback([of_data, data] { RequireDataFile(of_data, {data}); });
  command.add_option("--until", arguments->until_s, kUntilHelp)->required();
  command.add_option("--step", arguments->step_s,
                     "Step between possible sample times, s (default: a hundredth of --until)");
  command.add_option("--samples", arguments->samples, "Sample times to choose (default: 10)")
      ->check(WholeBetween(1, 1000));
  command
      .add_option("--candidate", arguments->candidate_files,
                  "A problem file whose inputs are another candidate")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  AddOutputs(command, arguments->outputs,
             "Further outputs that could be measured, comma-separated (default: all)");
  AddPlace(command, arguments->place);
  AddPlot(command, arguments->plot_file, "gains and standard deviations");
  AddFormat(command, arguments->format, {"table", "json"});
}

}  // namespace

void AddPlanningCommands(CommandRegistry& registry) {
  registry.StartGroup("Before you measure");
  AddModels(registry);
  AddInit(registry);
  AddCheck(registry);
  AddPropagate(registry);
  AddSensitivity(registry);
  AddDesign(registry);
}

void AddOtherCommands(CommandRegistry& registry) {
  registry.StartGroup("Other");
  registry.Add({.name = "schema",
                .summary = "Print the JSON schema of problem files, for editors",
                .examples = {"schema > problem.schema.json"}},
               std::make_shared<SchemaArguments>());
  const auto paper = std::make_shared<PaperOptions>();
  paper->threads = registry.threads();
  CLI::App& command = registry.Add({.name = "paper",
                                    .summary = "Rerun the paper's experiments",
                                    .examples = {"paper 14 --plot figure14.svg"}},
                                   paper);
  command.add_option(
      "figure", paper->figure,
      absl::StrCat("One experiment's name (default: all): ", absl::StrJoin(PaperFigures(), ", ")));
  command.add_option("--plot", paper->plot_file, "Draw the figure into this .svg or .png file");
  AddThreads(command, paper->threads);
}

}  // namespace polyest::internal
