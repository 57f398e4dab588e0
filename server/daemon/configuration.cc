#include "server/daemon/configuration.h"

#include <absl/strings/str_replace.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <memory>

#include "core/common/nearest_name.h"

namespace polyest::internal {
namespace {

constexpr char kConfig[] = "--config";
const std::string kVariablePrefix = "POLYESTD_";

std::string Variable(const std::string& name) {
  const char* value = std::getenv(name.c_str());
  return value == nullptr ? "" : value;
}

// Reads a file whose keys are options. Leaves out those that the environment sets, because CLI11
// would prefer the file.
class File final : public CLI::ConfigBase {
 public:
  explicit File(const CLI::App& app) : app_(app) {}

  std::vector<CLI::ConfigItem> from_config(std::istream& in) const override {
    std::vector<CLI::ConfigItem> kept;
    for (CLI::ConfigItem& item : ConfigBase::from_config(in)) {
      // This item marks a section, whose keys follow.
      if (item.name == "++" || item.name == "--") continue;
      const CLI::Option* option = app_.get_option_no_throw("--" + item.name);
      if (!item.parents.empty() || option == nullptr || !option->get_configurable()) {
        throw CLI::ConfigError("there is no key \"" + item.fullname() + "\"",
                               CLI::ExitCodes::ConfigError);
      }
      if (Variable(option->get_envname()).empty()) kept.push_back(std::move(item));
    }
    return kept;
  }

 private:
  const CLI::App& app_;
};

// Returns whether Kubernetes makes a variable of this name for a service that is called polyestd.
bool IsOfKubernetes(const std::string& variable) {
  return variable == "POLYESTD_PORT" || variable.rfind("POLYESTD_PORT_", 0) == 0 ||
         variable.rfind("POLYESTD_SERVICE_", 0) == 0;
}

bool IsGiven(const std::string& option, int argc, const char* const* argv) {
  return std::any_of(argv, argv + argc, [&](const std::string& argument) {
    return argument == option || argument.rfind(option + "=", 0) == 0;
  });
}

// Returns what is wrong with the first word that looks like an option and is none; empty: there is
// no such word.
std::string UnknownOption(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* const option : app.get_options()) names.push_back(option->get_name());
  for (const std::string& word : app.remaining()) {
    if (word.rfind("--", 0) != 0) continue;
    const std::string wrong = word.substr(0, word.find('='));
    const std::string nearest = NearestName(wrong, names);
    return "there is no option \"" + wrong + "\"; " +
           (nearest.empty() ? "polyestd --help lists the options"
                            : "did you mean \"" + nearest + "\"?");
  }
  return "";
}

}  // namespace

std::string EnvironmentVariable(const std::string& option) {
  std::string name = kVariablePrefix;
  for (const char c : option.substr(option.find_first_not_of('-'))) {
    name += c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return name;
}

std::string CheckEnvironment(const CLI::App& app, const char* const* environment) {
  std::vector<std::string> known{EnvironmentVariable(kConfig)};
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_envname().empty()) known.push_back(option->get_envname());
  }
  for (; *environment != nullptr; ++environment) {
    const std::string setting = *environment;
    const std::string name = setting.substr(0, setting.find('='));
    if (name.rfind(kVariablePrefix, 0) != 0 || IsOfKubernetes(name) ||
        std::find(known.begin(), known.end(), name) != known.end()) {
      continue;
    }
    // The prefix is left out, because it would make any two names similar.
    std::vector<std::string> names;
    for (const std::string& one : known) names.push_back(one.substr(kVariablePrefix.size()));
    const std::string nearest = NearestName(name.substr(kVariablePrefix.size()), names);
    return name + ": no option has this variable" +
           (nearest.empty() ? "; polyestd --help lists the options"
                            : "; did you mean " + kVariablePrefix + nearest + "?");
  }
  return "";
}

void AddConfiguration(CLI::App& app, const std::vector<std::string>& flags_only) {
  for (CLI::Option* option : app.get_options()) {
    const std::string name = option->get_name();
    const bool flag_only =
        name == "--help" || name == "--version" ||
        std::find(flags_only.begin(), flags_only.end(), name) != flags_only.end();
    option->configurable(!flag_only);
    if (!flag_only) option->envname(EnvironmentVariable(name));
  }
  const std::string file = Variable(EnvironmentVariable(kConfig));
  app.set_config(kConfig, file,
                 "File of options, one a line: data-dir = \"/srv/polyest\"; by default "
                 "$POLYESTD_CONFIG, if that is set",
                 !file.empty());
  app.config_formatter(std::make_shared<File>(app));
}

std::string DescribeError(const CLI::App& app, const CLI::ParseError& error, int argc,
                          const char* const* argv) {
  const std::string unknown = UnknownOption(app);
  if (!unknown.empty()) return unknown;
  const std::string what = absl::StrReplaceAll(error.what(), {{"\n", " "}});
  std::string file;
  const CLI::Option* const config = app.get_config_ptr();
  if (config != nullptr && !config->results().empty()) {
    file = config->results().front();
  } else {
    file = Variable(EnvironmentVariable(kConfig));
  }
  if (error.get_name() == "FileError") return file + ": cannot be read";
  if (error.get_name() == "ConfigError") return file + ": " + what;
  // For a bad value CLI11 says "--name: what is wrong".
  const std::string option = what.substr(0, what.find(':'));
  if (option.rfind("--", 0) != 0 || app.get_option_no_throw(option) == nullptr ||
      IsGiven(option, argc, argv)) {
    return what;
  }
  const std::string variable = EnvironmentVariable(option);
  if (!Variable(variable).empty()) return variable + what.substr(option.size());
  return file.empty() ? what : file + ": " + what.substr(2);
}

}  // namespace polyest::internal
