// Runs `polyest list`, which prints the sessions of a daemon.

#include "client/cli/answer.h"
#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "client/cli/session_list.h"

namespace polyest::internal {

int RunCommand(const ListArguments& arguments, std::ostream& out, std::ostream& err) {
  Client client(arguments.place.server, ToClientOptions(arguments.place));
  const auto list = ListAllSessions(client);
  if (!list.ok()) return Report(list.status(), arguments.place.server, err);
  if (arguments.format == Format::kJson) {
    return PrintJson(*list, arguments.place.server, out, err);
  }
  PrintSessions(*list, out);
  return kExitOk;
}

}  // namespace polyest::internal
