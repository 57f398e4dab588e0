#include <absl/strings/str_cat.h>

#include <filesystem>
#include <fstream>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "client/cli/starting_problem.h"
#include "core/common/status.h"
#include "polyest/catalogue.h"

namespace polyest::internal {
namespace {

absl::StatusOr<std::string> Text(const InitArguments& arguments) {
  if (arguments.equations) return kStartingEquations;
  const auto builtin = FindBuiltinModel(arguments.model);
  if (builtin.ok() || arguments.place.fmu_dir.empty()) {
    POLYEST_RETURN_IF_ERROR(builtin.status());
    return StartingProblem((*builtin)->description(), "builtin");
  }
  POLYEST_ASSIGN_OR_RETURN(const ModelLibrary models, OpenModels(arguments.place));
  POLYEST_ASSIGN_OR_RETURN(const auto fmu, models.FindFmu(arguments.model));
  return StartingProblem(fmu->description(), "fmu");
}

absl::Status WriteFile(const InitArguments& arguments, const std::string& text) {
  const std::string& path = arguments.output_file;
  std::error_code error;
  if (!arguments.force && std::filesystem::exists(path, error)) {
    return absl::AlreadyExistsError(
        absl::StrCat(path, ": already exists; use --force to overwrite it"));
  }
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << text;
  if (!out.flush()) return absl::InvalidArgumentError(absl::StrCat(path, ": cannot be written"));
  return absl::OkStatus();
}

}  // namespace

int RunCommand(const InitArguments& arguments, std::ostream& out, std::ostream& err) {
  if (arguments.model.empty() && !arguments.equations) {
    ModelsArguments list;
    list.place = arguments.place;
    return RunCommand(list, out, err);
  }
  const absl::StatusOr<std::string> text = Text(arguments);
  if (!text.ok()) return Report(text.status(), "", err);
  if (arguments.output_file.empty()) {
    out << *text;
    return kExitOk;
  }
  const absl::Status written = WriteFile(arguments, *text);
  return written.ok() ? kExitOk : Report(written, "", err);
}

}  // namespace polyest::internal
