// Runs `polyest delete`, which deletes a session of a daemon with all its measurements.

#include <absl/strings/str_cat.h>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"

namespace polyest::internal {

int RunCommand(const DeleteArguments& arguments, std::ostream& out, std::ostream& err) {
  Client client(arguments.place.server, ToClientOptions(arguments.place));
  v1::DeleteSessionRequest request;
  request.set_name(absl::StrCat("sessions/", arguments.session));
  const absl::Status deleted = client.DeleteSession(request);
  if (!deleted.ok()) return Report(deleted, arguments.place.server, err);
  out << "deleted " << request.name() << std::endl;
  return kExitOk;
}

}  // namespace polyest::internal
