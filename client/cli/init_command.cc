#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <filesystem>
#include <string>
#include <vector>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "client/cli/proposed_columns.h"
#include "client/cli/starting_problem.h"
#include "client/cli/text_table.h"
#include "client/cpp/data/cells.h"
#include "client/plot/output_file.h"
#include "core/common/status.h"
#include "polyest/catalogue.h"

namespace polyest::internal {
namespace {

// Returns the problem for a model; for the columns of a data file if the arguments name one.
absl::StatusOr<std::string> Write(const ModelDescription& model, const char* source,
                                  const InitArguments& arguments, std::ostream& err) {
  if (arguments.data_file.empty()) return StartingProblem(model, source);
  POLYEST_ASSIGN_OR_RETURN(const RecordedColumns recorded,
                           ReadColumns(arguments.data_file, arguments.data_options));
  const ProposedColumns proposed = ProposeColumns(model, recorded);
  POLYEST_RETURN_IF_ERROR(CheckProposal(model, recorded, proposed, arguments.data_file));
  err << arguments.data_file << ": " << Describe(recorded, proposed) << std::endl;
  return StartingProblem(model, source, &proposed);
}

absl::StatusOr<std::string> Text(const InitArguments& arguments, std::ostream& err) {
  if (arguments.equations) return kStartingEquations;
  const auto builtin = FindBuiltinModel(arguments.model);
  if (builtin.ok()) return Write((*builtin)->description(), "builtin", arguments, err);
  POLYEST_ASSIGN_OR_RETURN(const ModelLibrary models, OpenModels(arguments.place));
  POLYEST_ASSIGN_OR_RETURN(const auto model, models.Find(arguments.model));
  const bool fmu = models.FindFmu(arguments.model).ok();
  return Write(model->description(), fmu ? "fmu" : "umbridge", arguments, err);
}

absl::Status NoModel(const RecordedColumns& recorded, const std::string& file) {
  std::vector<std::string> headers;
  for (const ColumnName& column : recorded.names) headers.push_back(QuoteCell(column.header));
  return absl::InvalidArgumentError(absl::StrCat(
      file, ": no model fits these columns: ",
      headers.empty() ? "there is none besides the time" : absl::StrJoin(headers, ", "),
      "; a column fits by the name of an output, or by a unit that only one output has"));
}

// Lists the models with outputs that the columns of the data file may be.
absl::Status ListModels(const InitArguments& arguments, std::ostream& out) {
  POLYEST_ASSIGN_OR_RETURN(const RecordedColumns recorded,
                           ReadColumns(arguments.data_file, arguments.data_options));
  TextTable table({"model", "columns"});
  bool any = false;
  for (const auto& model : BuiltinModels()) {
    const ProposedColumns proposed = ProposeColumns(model->description(), recorded);
    if (!CheckProposal(model->description(), recorded, proposed, arguments.data_file).ok())
      continue;
    any = true;
    table.AddRow({model->description().name, Describe(recorded, proposed)});
  }
  if (!any) return NoModel(recorded, arguments.data_file);
  table.Print(out);
  return absl::OkStatus();
}

absl::Status WriteFile(const InitArguments& arguments, const std::string& text) {
  const std::string& path = arguments.output_file;
  std::error_code error;
  if (!arguments.force && std::filesystem::exists(path, error)) {
    return absl::AlreadyExistsError(
        absl::StrCat(path, ": already exists; use --force to overwrite it"));
  }
  return WriteOutputFile("--output", path, text);
}

}  // namespace

int RunCommand(const InitArguments& arguments, std::ostream& out, std::ostream& err) {
  if (arguments.model.empty() && !arguments.data_file.empty()) {
    const absl::Status listed = ListModels(arguments, out);
    return listed.ok() ? kExitOk : Report(listed, "", err);
  }
  if (arguments.model.empty() && !arguments.equations) {
    ModelsArguments list;
    list.place = arguments.place;
    return RunCommand(list, out, err);
  }
  const absl::StatusOr<std::string> text = Text(arguments, err);
  if (!text.ok()) return Report(text.status(), "", err);
  if (arguments.output_file.empty()) {
    out << *text;
    return kExitOk;
  }
  const absl::Status written = WriteFile(arguments, *text);
  return written.ok() ? kExitOk : Report(written, "", err);
}

}  // namespace polyest::internal
