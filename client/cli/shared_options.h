#pragma once

// Adds the options that several commands share.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client/cli/arguments.h"

namespace polyest::internal {

// Accepts numbers from `least` to `most`. CLI::Range accepts "nan" as well.
CLI::Validator Between(double least, double most);
// Accepts whole numbers from `least` to `most`.
CLI::Validator WholeBetween(int least, int most);
// Adds --server, --deadline and the options for access to a daemon. Returns --server.
CLI::Option* AddServer(CLI::App& command, Place& place);
// Adds --fmu-dir and --umbridge-dir and returns them.
std::vector<CLI::Option*> AddModelFolders(CLI::App& command, Place& place);
// Adds --threads and returns it.
CLI::Option* AddThreads(CLI::App& command, int& threads);
// Adds the choice between a daemon and this process: AddServer, --local, AddModelFolders and
// --threads. Returns --server.
CLI::Option* AddPlace(CLI::App& command, Place& place);
// AddProblem and AddData add the files as required arguments.
void AddProblem(CLI::App& command, std::string& file);
void AddData(CLI::App& command, std::string& file);
// Adds what can be said about a data file: --delimiter, --decimal, --time-column, --time-zero and
// --date-order. Returns them.
std::vector<CLI::Option*> AddDataOptions(CLI::App& command, DataFileOptions& options);
// Throws CLI::RequiresError if one of these options about a data file is given but none of the
// options that name such a file.
void RequireDataFile(const std::vector<CLI::Option*>& options,
                     const std::vector<const CLI::Option*>& files);
// The option of a command that names a data file beside those of AddStudyInput.
inline constexpr char kValidate[] = "--validate";
// Adds problem and data files, or --session in their place, for a study of an estimate.
void AddStudyInput(CLI::App& command, StudyInput& input);
// Adds --outputs, a comma-separated list, with a help that begins with `help`.
void AddOutputs(CLI::App& command, std::vector<std::string>& outputs, const char* help);
// Adds --plot. `what`: what it draws, as in "the fit".
void AddPlot(CLI::App& command, std::string& file, const char* what);
// Adds --format with these names; the first is the default.
void AddFormat(CLI::App& command, Format& format, const std::vector<std::string>& names);

}  // namespace polyest::internal
