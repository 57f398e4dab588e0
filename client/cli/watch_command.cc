// Runs `polyest watch`, which prints the estimates of a session as they are made.

#include <absl/strings/str_cat.h>
#include <poll.h>

#include <optional>
#include <thread>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/estimate_format.h"
#include "client/cli/exit_status.h"
#include "client/cli/interrupt.h"
#include "client/cli/progress_line.h"
#include "core/common/status.h"
#include "proto/wire/json/json_format.h"

namespace polyest::internal {
namespace {

// Cancels a call when Ctrl-C is pressed while the object exists.
class CancelOnInterrupt {
 public:
  CancelOnInterrupt(const Interrupt& interrupt, grpc::ClientContext& call)
      : thread_([&interrupt, &call](const std::stop_token& ended) {
          while (!ended.stop_requested()) {
            pollfd wanted = {interrupt.descriptor(), POLLIN, 0};
            if (poll(&wanted, 1, kIntervalMs) <= 0) continue;
            call.TryCancel();
            return;
          }
        }) {}

 private:
  static constexpr int kIntervalMs = 100;
  std::jthread thread_;
};

// Refuses a session whose first sample has not arrived: nobody knows when there is an estimate.
absl::Status CheckHasSamples(Client& client, const std::string& session) {
  v1::GetSessionRequest get;
  get.set_name(session);
  get.set_omit_problem(true);
  POLYEST_ASSIGN_OR_RETURN(const v1::Session found, client.GetSession(get));
  if (found.sample_count() > 0) return absl::OkStatus();
  return absl::NotFoundError(absl::StrCat(session, " has no estimate yet: no sample has arrived"));
}

}  // namespace

int RunCommand(const WatchArguments& arguments, std::ostream& out, std::ostream& err) {
  const Interrupt interrupt;
  Client client(arguments.place.server, ToClientOptions(arguments.place));
  v1::WatchSessionRequest request;
  request.set_session(absl::StrCat("sessions/", arguments.session));
  if (arguments.once) {
    const absl::Status checked = CheckHasSamples(client, request.session());
    if (!checked.ok()) return Report(checked, arguments.place.server, err);
  }
  std::optional<v1::Estimate> last;
  grpc::ClientContext call;
  absl::Status status;
  {
    ProgressLine progress([&] { return absl::StrCat("watching ", request.session()); });
    const CancelOnInterrupt cancel(interrupt, call);
    const auto print = [&](const v1::WatchSessionResponse& response) {
      last = response.estimate();
      // The table printed at the end contains the line.
      if (arguments.once && arguments.format == Format::kTable) return false;
      progress.Interject([&] {
        out << (arguments.format == Format::kJsonLines ? ToJson(*last, /*several_lines=*/false)
                                                       : EstimateLine(*last))
            << std::endl;
      });
      return !arguments.once && !out.fail();
    };
    status = client.WatchSession(request, print, &call);
  }
  if (!status.ok() && !interrupt.Requested()) return Report(status, arguments.place.server, err);
  if (arguments.format == Format::kTable && last) {
    if (!arguments.once) out << '\n';
    PrintEstimate(*last, out);
  }
  if (arguments.once && last && last->samples() == 0) {
    err << "polyest: no sample of " << request.session()
        << " counts yet, and these are the numbers of the prior; rows may wait for later ones\n";
  }
  return kExitOk;
}

}  // namespace polyest::internal
