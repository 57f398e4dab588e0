#include "client/cli/arguments.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <optional>
#include <sstream>
#include <thread>

#include "client/cli/command_registry.h"
#include "client/cli/exit_status.h"
#include "core/common/nearest_name.h"

namespace polyest::internal {
namespace {

constexpr int kMaxThreads = 256;

const std::map<std::string, ColorChoice> kColors = {
    {"auto", ColorChoice::kAuto}, {"always", ColorChoice::kAlways}, {"never", ColorChoice::kNever}};

// Wraps descriptions to the width of the screen.
class HelpFormatter : public CLI::Formatter {
 public:
  explicit HelpFormatter(int columns) : columns_(columns) {}

  std::string make_option_desc(const CLI::Option* option) const override {
    return Fit(CLI::Formatter::make_option_desc(option));
  }
  std::string make_subcommand(const CLI::App* command) const override {
    std::ostringstream out;
    CLI::detail::format_help(out, command->get_name(), Fit(command->get_description()),
                             column_width_);
    return out.str();
  }

 private:
  std::string Fit(const std::string& description) const {
    return WrapText(description, columns_ > 0 ? columns_ - static_cast<int>(column_width_) : 0);
  }

  const int columns_;
};

std::string Footer(const CommandText& text) {
  std::string footer = text.notes;
  if (text.examples.empty()) return footer;
  absl::StrAppend(&footer, footer.empty() ? "" : "\n\n", "Examples:");
  for (const char* const example : text.examples) {
    absl::StrAppend(&footer, "\n  polyest ", example);
  }
  return footer;
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* const command : app.get_subcommands({})) {
    names.push_back(command->get_name());
  }
  return names;
}

// Returns an error message if the first word is not the name of a command.
std::optional<std::string> UnknownCommand(const CLI::App& app, int argc, const char* const* argv) {
  if (argc < 2 || absl::StartsWith(argv[1], "-")) return std::nullopt;
  const std::vector<std::string> names = CommandNames(app);
  if (std::find(names.begin(), names.end(), argv[1]) != names.end()) return std::nullopt;
  const std::string nearest = NearestName(argv[1], names);
  const std::string hint =
      nearest.empty() ? absl::StrCat("the commands are ", absl::StrJoin(names, ", "), "; see")
                      : absl::StrCat("did you mean \"", nearest, "\"? See");
  return absl::StrCat("there is no command \"", argv[1], "\"; ", hint, " polyest --help");
}

// Returns an error message if a word that looks like an option is not an option of the command.
std::optional<std::string> UnknownOption(const CLI::App& app) {
  const std::vector<CLI::App*> parsed = app.get_subcommands();
  const CLI::App& command = parsed.empty() ? app : *parsed.front();
  for (const std::string& word : app.remaining(/*recurse=*/true)) {
    if (word.size() < 2 || word[0] != '-') continue;
    std::vector<std::string> names;
    for (const CLI::Option* const option : command.get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
    const std::string wrong = word.substr(0, word.find('='));
    const std::string nearest = NearestName(wrong, names);
    return absl::StrCat("there is no option \"", wrong, "\"",
                        nearest.empty() ? "" : absl::StrCat("; did you mean \"", nearest, "\"?"));
  }
  return std::nullopt;
}

// Returns "--until: x must be a number" for a value that CLI11 "could not convert: --until = x",
// and the words of other errors in one line.
std::string Words(const CLI::ParseError& error) {
  const std::string words = absl::StrReplaceAll(error.what(), {{"\n", " "}});
  constexpr absl::string_view kNumber = "Could not convert: ";
  const size_t at = words.find(" = ");
  if (!absl::StartsWith(words, kNumber) || at == words.npos) return words;
  return absl::StrCat(words.substr(kNumber.size(), at - kNumber.size()), ": ", words.substr(at + 3),
                      " must be a number");
}

// Prints an error of the command line in one line and returns the exit status.
int ReportUsage(const CLI::App& app, const CLI::ParseError& error, std::ostream& err) {
  const std::vector<CLI::App*> parsed = app.get_subcommands();
  const std::string command = parsed.empty() ? "" : parsed.front()->get_name();
  const std::string what = UnknownOption(app).value_or(Words(error));
  err << "polyest: " << (command.empty() ? "" : command + ": ") << what << "; see polyest "
      << (command.empty() ? "" : command + " ") << "--help" << std::endl;
  return kExitBadInput;
}

}  // namespace

CLI::App& CommandRegistry::AddCommand(const CommandText& text) {
  CLI::App& command = *app_.add_subcommand(text.name, text.summary);
  command.group(group_);
  command.footer(Footer(text));
  command
      .add_option_function<std::string>(
          "--color", [this](const std::string& name) { color_ = kColors.at(name); },
          "Colours: auto (on a terminal, unless NO_COLOR is set), always or never")
      ->check(CLI::IsMember(kColors))
      ->type_name("WHEN")
      ->group("Appearance");
  return command;
}

std::variant<CommandLine, int> ParseArguments(int argc, const char* const* argv, std::ostream& out,
                                              std::ostream& err) {
  CLI::App app("Estimates uncertain parameters of mechanical models from measurements.", "polyest");
  app.set_version_flag("--version", "polyest " POLYEST_VERSION);
  app.require_subcommand(1);
  // The commands added below inherit the formatter.
  app.formatter(
      std::make_shared<HelpFormatter>(ScreenOf(STDOUT_FILENO, ColorChoice::kNever).columns));
  app.footer(
      "polyest COMMAND --help describes a command and has examples.\n"
      "Exit status: 0 success, 1 other error, 2 invalid usage or input, 3 server unreachable or\n"
      "request refused.");
  const int cores = static_cast<int>(std::thread::hardware_concurrency());
  CommandRegistry registry(app, std::clamp(cores, 1, kMaxThreads));
  AddEstimationCommands(registry);
  AddPlanningCommands(registry);
  AddSessionCommands(registry);
  AddDaemonCommands(registry);
  AddOtherCommands(registry);
  if (const auto unknown = UnknownCommand(app, argc, argv)) {
    err << "polyest: " << *unknown << std::endl;
    return static_cast<int>(kExitBadInput);
  }
  try {
    app.parse(argc, argv);
    return registry.Result();
  } catch (const CLI::Success& success) {
    return app.exit(success, out, err);
  } catch (const CLI::ParseError& error) {
    return ReportUsage(app, error, err);
  }
}

}  // namespace polyest::internal
