#include <unistd.h>

#include <chrono>
#include <optional>
#include <sstream>
#include <utility>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "client/cli/interrupt.h"
#include "client/cli/top_table.h"
#include "client/cpp/client.h"
#include "core/common/status.h"

namespace polyest {
namespace {

using Clock = std::chrono::steady_clock;

// Home, and nothing below: a terminal that is cleared first would flicker.
constexpr char kHome[] = "\x1b[H\x1b[J";

absl::StatusOr<DaemonView> Look(Client& client) {
  DaemonView view;
  POLYEST_ASSIGN_OR_RETURN(view.status, client.GetStatus({}));
  v1::ListSessionsRequest request;
  do {
    POLYEST_ASSIGN_OR_RETURN(const v1::ListSessionsResponse page, client.ListSessions(request));
    view.sessions.insert(view.sessions.end(), page.sessions().begin(), page.sessions().end());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  view.time_s = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
  return view;
}

absl::Status Show(const TopArguments& arguments, const Interrupt& interrupt, std::ostream& out) {
  Client client(arguments.place.server, ToClientOptions(arguments.place));
  const bool redraw = !arguments.once && isatty(STDOUT_FILENO) != 0;
  std::optional<DaemonView> before;
  while (!interrupt.Requested()) {
    POLYEST_ASSIGN_OR_RETURN(DaemonView now, Look(client));
    // In one piece, so that no half of it is ever seen.
    std::ostringstream text;
    PrintTop(now, before ? &*before : nullptr, text);
    if (before && !redraw) out << '\n';
    out << (redraw ? kHome : "") << text.str() << std::flush;
    if (arguments.once || !out) break;
    before = std::move(now);
    interrupt.WaitUntil(Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(arguments.interval_s)));
  }
  return absl::OkStatus();
}

}  // namespace

int RunCommand(const TopArguments& arguments, std::ostream& out, std::ostream& err) {
  const Interrupt interrupt;
  const absl::Status shown = Show(arguments, interrupt, out);
  return shown.ok() ? kExitOk : Report(shown, arguments.place.server, err);
}

}  // namespace polyest
