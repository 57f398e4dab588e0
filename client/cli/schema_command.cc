#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "proto/problem_schema.h"

namespace polyest::internal {

int RunCommand(const SchemaArguments&, std::ostream& out, std::ostream&) {
  out << kProblemSchema;
  return kExitOk;
}

}  // namespace polyest::internal
