#include <unistd.h>

#include <chrono>
#include <optional>
#include <sstream>
#include <utility>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_status.h"
#include "client/cli/interrupt.h"
#include "client/cli/keyboard.h"
#include "client/cli/screen.h"
#include "client/cli/session_list.h"
#include "client/cli/top_table.h"
#include "core/common/status.h"
#include "polyest/client.h"

namespace polyest::internal {
namespace {

using Clock = std::chrono::steady_clock;

// Moves the cursor to the top left and clears the screen from there. Clearing the whole screen
// first would make it flicker.
constexpr char kHome[] = "\x1b[H\x1b[J";

absl::StatusOr<DaemonView> Look(Client& client) {
  DaemonView view;
  POLYEST_ASSIGN_OR_RETURN(view.status, client.GetStatus({}));
  POLYEST_ASSIGN_OR_RETURN(v1::ListSessionsResponse list, ListAllSessions(client));
  view.sessions.assign(std::make_move_iterator(list.mutable_sessions()->begin()),
                       std::make_move_iterator(list.mutable_sessions()->end()));
  view.time_s = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
  return view;
}

absl::Status Show(const TopArguments& arguments, const Interrupt& interrupt, std::ostream& out) {
  Client client(arguments.place.server, ToClientOptions(arguments.place));
  const bool redraw = !arguments.once && isatty(STDOUT_FILENO) != 0;
  std::optional<Keyboard> keyboard;
  if (redraw) keyboard.emplace();
  std::optional<DaemonView> before;
  while (!interrupt.Requested()) {
    POLYEST_ASSIGN_OR_RETURN(DaemonView now, Look(client));
    // The size of the window may have changed.
    if (redraw) {
      Screen screen = ScreenOf(STDOUT_FILENO, ColorChoice::kNever);
      screen.color = GetScreen(out).color;
      SetScreen(out, screen);
    }
    // The text is printed at once, so that no incomplete table is visible.
    std::ostringstream text;
    text.copyfmt(out);
    PrintTop(now, before ? &*before : nullptr, redraw, text);
    if (before && !redraw) out << '\n';
    out << (redraw ? kHome : "") << text.str() << std::flush;
    if (arguments.once || !out) break;
    before = std::move(now);
    const auto next = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                         std::chrono::duration<double>(arguments.interval_s));
    if (!keyboard) {
      interrupt.WaitUntil(next);
    } else if (keyboard->WaitForQuit(next, interrupt)) {
      break;
    }
  }
  return absl::OkStatus();
}

}  // namespace

int RunCommand(const TopArguments& arguments, std::ostream& out, std::ostream& err) {
  const Interrupt interrupt;
  const absl::Status shown = Show(arguments, interrupt, out);
  return shown.ok() ? kExitOk : Report(shown, arguments.place.server, err);
}

}  // namespace polyest::internal
