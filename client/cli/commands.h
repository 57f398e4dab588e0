#pragma once

// Runs the commands. Each function prints its results to `out` and errors, one line each, to `err`,
// and returns the exit status.

#include <ostream>

#include "client/cli/arguments.h"

namespace polyest::internal {

int RunCommand(const EstimateArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const StreamArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const PropagateArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const CostArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const ModelsArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const CheckArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const InitArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const SchemaArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const SensitivityArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const DesignArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const ExplainArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const PosteriorArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const FitArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const CompareArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const ReportArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const ProfileArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const RegularizationArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const ExportArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const ImportArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const DeleteArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const ListArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const WatchArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const BackupArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const NodesArguments& arguments, std::ostream& out, std::ostream& err);
int RunCommand(const TopArguments& arguments, std::ostream& out, std::ostream& err);

}  // namespace polyest::internal
