#include "client/cli/arguments.h"

#include <absl/strings/str_replace.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <thread>

#include "client/cli/exit_status.h"
#include "client/cli/shared_options.h"

namespace polyest {
namespace {

// One method a command.
class Parser {
 public:
  Parser() : app_("Estimates uncertain parameters of mechanical models from measurements.") {
    app_.name("polyest");
    app_.set_version_flag("--version", "polyest " POLYEST_VERSION);
    app_.require_subcommand(1);
    app_.footer(
        "Exit status: 0 success, 2 bad usage or input, 3 server unreachable or refused, 1 else.");
    const int cores = static_cast<int>(std::thread::hardware_concurrency());
    threads_ = std::clamp(cores, 1, 256);
    paper_.threads = threads_;
    AddEstimate();
    AddExplain();
    AddStream();
    AddPropagate();
    AddCost();
    AddModels();
    AddCheck();
    AddInit();
    AddSchema();
    AddSensitivity();
    AddDesign();
    AddPaper();
    AddPosterior();
    AddProfile();
    AddRegularization();
    AddExport();
    AddImport();
    AddDelete();
    AddTop();
  }

  CLI::App& app() { return app_; }

  Command Result() {
    const std::string name = app_.get_subcommands().front()->get_name();
    if (name == "estimate") return Placed(estimate_);
    if (name == "explain") return Placed(explain_);
    if (name == "stream") return Placed(stream_);
    if (name == "propagate") return Placed(propagate_);
    if (name == "cost") return Placed(cost_);
    if (name == "models") return Placed(models_);
    if (name == "check") return Placed(check_);
    if (name == "init") return Placed(init_);
    if (name == "schema") return SchemaArguments{};
    if (name == "sensitivity") return Placed(sensitivity_);
    if (name == "design") return Placed(design_);
    if (name == "posterior") return Placed(posterior_);
    if (name == "profile") return Placed(profile_);
    if (name == "regularization") return Placed(regularization_);
    if (name == "export") return Placed(export_);
    if (name == "import") return Placed(import_);
    if (name == "delete") return Placed(delete_);
    if (name == "top") return Placed(top_);
    return paper_;
  }

 private:
  // Each command has one of its own: the parser takes the environment into the options of those
  // commands, too, that are not given.
  Place& PlaceOf(CLI::App& command) {
    Place place;
    place.threads = threads_;
    return places_.try_emplace(&command, place).first->second;
  }

  template <typename Arguments>
  Command Placed(Arguments arguments) {
    arguments.place = PlaceOf(*app_.get_subcommands().front());
    return arguments;
  }

  void AddEstimate() {
    CLI::App& command = *app_.add_subcommand("estimate", "Estimate from a data file");
    AddProblem(command, estimate_.problem_file);
    command.add_option("data", estimate_.data_file, "The measurements, a CSV file")->required();
    AddPlace(command, PlaceOf(command));
    AddFormat(command, estimate_.format, {"table", "json"});
  }

  void AddExplain() {
    CLI::App& command = *app_.add_subcommand(
        "explain", "Say in words what the data tell, what they do not, and what would help");
    AddProblem(command, explain_.problem_file);
    command.add_option("data", explain_.data_file, "The measurements, a CSV file")->required();
    AddPlace(command, PlaceOf(command));
  }

  void AddStream() {
    CLI::App& command =
        *app_.add_subcommand("stream", "Stream data to a daemon, printing each estimate");
    AddProblem(command, stream_.problem_file);
    command.add_option("data", stream_.data_file, "The measurements, a CSV file, or -")->required();
    AddServer(command, PlaceOf(command))->required();
    command.add_option("--batch", stream_.batch_rows, "Rows a message")
        ->check(CLI::Range(1, 100'000))
        ->capture_default_str();
    command
        .add_option("--rate", stream_.rate,
                    "Send this many times as fast as the data's time; 0: at once")
        ->check(CLI::Range(0.0, 1e9));
    command.add_option(
        "--session", stream_.session,
        "The session to create, or to resume: then with rows after its last, in the same run "
        "too, so that the last few rows of a smooth streamed input wait for them");
    AddFormat(command, stream_.format, {"table", "jsonl"});
  }

  void AddPropagate() {
    CLI::App& command =
        *app_.add_subcommand("propagate", "Predict the outputs over time from the prior");
    AddProblem(command, propagate_.problem_file);
    command.add_option("--until", propagate_.until_s, "The last time, s")->required();
    command.add_option("--step", propagate_.step_s, "From one time to the next, s")->required();
    AddPlace(command, PlaceOf(command));
    AddFormat(command, propagate_.format, {"table", "json", "csv"});
  }

  void AddCost() {
    CLI::App& command =
        *app_.add_subcommand("cost", "The cost over one or two uncertain parameters");
    AddProblem(command, cost_.problem_file);
    command.add_option("data", cost_.data_file, "The measurements, a CSV file")->required();
    command
        .add_option("--parameter", cost_.parameters,
                    "A parameter to vary, at most two (default: the first two)")
        ->expected(1)
        ->take_all();
    command.add_option("--grid", cost_.grid_points, "Points an axis; 0: 201 for one, 41 for two")
        ->check(CLI::Range(0, 1001));
    AddPlace(command, PlaceOf(command));
    AddFormat(command, cost_.format, {"json", "csv"});
  }

  void AddModels() {
    CLI::App& command =
        *app_.add_subcommand("models", "List the models there are, or describe one");
    command.add_option("name", models_.name, "A model's name");
    AddPlace(command, PlaceOf(command));
    AddFormat(command, models_.format, {"table", "json"});
  }

  void AddCheck() {
    CLI::App& command = *app_.add_subcommand(
        "check",
        "Say all that is wrong with a problem, and with data for it, before anything runs");
    AddProblem(command, check_.problem_file);
    command.add_option("data", check_.data_file, "The measurements, a CSV file");
    AddFmuFolder(command, PlaceOf(command));
    AddFormat(command, check_.format, {"table", "json"});
  }

  void AddInit() {
    CLI::App& command =
        *app_.add_subcommand("init", "Write a problem file to start from; list the models");
    CLI::Option* const model = command.add_option("model", init_.model, "A model's name");
    command.add_flag("--equations", init_.equations, "With a model given by its equations")
        ->excludes(model);
    command.add_option("-o,--output", init_.output_file, "The file (default: standard output)");
    command.add_flag("--force", init_.force, "Overwrite the file if it is there");
    AddFmuFolder(command, PlaceOf(command));
  }

  void AddSchema() {
    app_.add_subcommand("schema", "Print the JSON schema of problem files, for editors");
  }

  void AddSensitivity() {
    CLI::App& command = *app_.add_subcommand(
        "sensitivity", "Say which uncertain parameters the outputs depend on, and when");
    AddProblem(command, sensitivity_.problem_file);
    command.add_option("--until", sensitivity_.until_s, "The last time, s")->required();
    command.add_option("--step", sensitivity_.step_s,
                       "From one time to the next, s (default: a hundredth of the last)");
    AddOutputs(command, sensitivity_.outputs, "The outputs, comma-separated (default: measured)");
    AddPlace(command, PlaceOf(command));
    AddFormat(command, sensitivity_.format, {"table", "json", "csv"});
  }

  void AddDesign() {
    CLI::App& command =
        *app_.add_subcommand("design", "Say which samples of a next experiment would tell most");
    AddProblem(command, design_.problem_file);
    command.add_option("data", design_.data_file, "What has been measured so far, a CSV file");
    command.add_option("--until", design_.until_s, "The last possible sample time, s")->required();
    command.add_option("--step", design_.step_s,
                       "From one possible sample time to the next, s (default: a hundredth of the "
                       "last)");
    command.add_option("--samples", design_.samples, "Sample times to choose (default: 10)")
        ->check(CLI::Range(1, 1000));
    command
        .add_option("--candidate", design_.candidate_files,
                    "A problem file whose inputs are another candidate")
        ->expected(1)
        ->take_all();
    AddOutputs(command, design_.outputs,
               "Further outputs that could be measured, comma-separated (default: all)");
    AddPlace(command, PlaceOf(command));
    AddFormat(command, design_.format, {"table", "json"});
  }

  void AddPaper() {
    CLI::App& command = *app_.add_subcommand("paper", "Rerun the paper's experiments");
    command.add_option("figure", paper_.figure, "One experiment's name (default: all)");
    command.add_option("--plot", paper_.plot_file, "Draw the figure into this SVG file");
    command.add_option("--threads", paper_.threads, "Threads for computing")
        ->check(CLI::Range(1, 256))
        ->capture_default_str();
  }

  void AddPosterior() {
    CLI::App& command = *app_.add_subcommand(
        "posterior", "The posterior in detail: densities, quantiles and samples");
    AddProblem(command, posterior_.problem_file);
    command.add_option("data", posterior_.data_file, "The measurements, a CSV file")->required();
    command.add_option("--samples", posterior_.samples, "Samples of the posterior to print")
        ->check(CLI::Range(0, 100'000));
    command
        .add_option("--quantiles", posterior_.probabilities,
                    "Probabilities of the quantiles, P,P,… (default 0.025,0.5,0.975)")
        ->delimiter(',');
    command
        .add_option("--joint", posterior_.joints,
                    "Two parameters whose joint density is wanted, NAME,NAME; may be repeated")
        ->expected(1)
        ->take_all();
    command.footer(
        "As csv: the samples if --samples is given, else the joint densities if --joint is, else "
        "one row a parameter. The densities of single parameters are in json.");
    AddPlace(command, PlaceOf(command));
    AddFormat(command, posterior_.format, {"table", "json", "csv"});
  }

  void AddProfile() {
    CLI::App& command = *app_.add_subcommand(
        "profile", "The cost over each parameter, minimized over all the others");
    AddProblem(command, profile_.problem_file);
    command.add_option("data", profile_.data_file, "The measurements, a CSV file")->required();
    command
        .add_option("--parameter", profile_.parameters,
                    "A parameter to profile; may be repeated (default: all)")
        ->expected(1)
        ->take_all();
    command.add_option("--points", profile_.points, "Values of each parameter (default 41)")
        ->check(CLI::Range(3, 1'001));
    command.footer(
        "On the expansion, over four posterior standard deviations to each side of the minimum as "
        "far as the prior and the region go in which the expansion is trusted.");
    AddPlace(command, PlaceOf(command));
    AddFormat(command, profile_.format, {"table", "json", "csv"});
  }

  void AddRegularization() {
    CLI::App& command = *app_.add_subcommand(
        "regularization", "The estimate over the weight α² of the prior, and which α² to choose");
    AddProblem(command, regularization_.problem_file);
    command.add_option("data", regularization_.data_file, "The measurements, a CSV file")
        ->required();
    command.add_option("--lowest", regularization_.lowest, "The least α² (default 1e-4)")
        ->check(CLI::Range(1e-8, 1e8));
    command.add_option("--highest", regularization_.highest, "The greatest α² (default 1e4)")
        ->check(CLI::Range(1e-8, 1e8));
    command.add_option("--points", regularization_.points, "Values of α² (default 33)")
        ->check(CLI::Range(2, 1'001));
    command.add_option("--plot", regularization_.plot_file, "Draw the sweep into this SVG file");
    command.footer(
        "On the expansion where the posterior of α² = 1 is: an α² that pulls the estimate out of "
        "the region in which it is trusted is left out. The rules choose from 1e-4 … 1e4.");
    AddPlace(command, PlaceOf(command));
    AddFormat(command, regularization_.format, {"table", "json", "csv"});
  }

  void AddExport() {
    CLI::App& command = *app_.add_subcommand("export", "Write a session of a daemon into a file");
    command.add_option("session", export_.session, "The session's name")->required();
    command.add_option("file", export_.file, "The file to write")->required();
    AddServer(command, PlaceOf(command))->required();
  }

  void AddImport() {
    CLI::App& command = *app_.add_subcommand(
        "import", "Make a session of a daemon out of a file: the same estimate to the last bit");
    command.add_option("file", import_.file, "What `polyest export` has written")->required();
    command.add_option("--session", import_.session, "Its name there (default the one it had)");
    AddServer(command, PlaceOf(command))->required();
  }

  void AddDelete() {
    CLI::App& command = *app_.add_subcommand(
        "delete", "Delete a session of a daemon, with all that was measured for it");
    command.add_option("session", delete_.session, "The session's name")->required();
    AddServer(command, PlaceOf(command))->required();
  }

  void AddTop() {
    CLI::App& command =
        *app_.add_subcommand("top", "Show how a daemon and its sessions are, until Ctrl-C");
    AddServer(command, PlaceOf(command))->required();
    command.add_flag("--once", top_.once, "Once, and end");
    command.add_option("--interval", top_.interval_s, "From one look to the next, s")
        ->check(CLI::Range(0.1, 3600.0))
        ->capture_default_str();
    command.footer(
        "Of each session: the batches acknowledged, estimates made and re-expansions since the "
        "daemon was started, values of measured outputs in all and a second, seconds of "
        "measurements over seconds computed for them (below 1 it falls behind), whether a stream "
        "is open and how many watch, whether it is in memory, seconds since its last use.");
  }

  CLI::App app_;
  int threads_ = 1;
  std::map<CLI::App*, Place> places_;
  EstimateArguments estimate_;
  ExplainArguments explain_;
  StreamArguments stream_;
  PropagateArguments propagate_;
  CostArguments cost_;
  ModelsArguments models_;
  CheckArguments check_;
  InitArguments init_;
  SensitivityArguments sensitivity_;
  DesignArguments design_;
  PaperOptions paper_;
  PosteriorArguments posterior_;
  ProfileArguments profile_;
  RegularizationArguments regularization_;
  ExportArguments export_;
  ImportArguments import_;
  DeleteArguments delete_;
  TopArguments top_;
};

}  // namespace

std::variant<Command, int> ParseArguments(int argc, const char* const* argv, std::ostream& out,
                                          std::ostream& err) {
  Parser parser;
  try {
    parser.app().parse(argc, argv);
    return parser.Result();
  } catch (const CLI::Success& success) {
    return parser.app().exit(success, out, err);
  } catch (const CLI::ParseError& error) {
    err << "polyest: " << absl::StrReplaceAll(error.what(), {{"\n", " "}}) << "; see polyest --help"
        << std::endl;
    return static_cast<int>(kExitBadInput);
  }
}

}  // namespace polyest
