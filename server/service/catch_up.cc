#include "server/service/catch_up.h"

#include "core/common/status.h"
#include "server/execution/guarded.h"

namespace polyest::internal {

void CatchUp(const std::shared_ptr<Session>& session, const std::stop_token& stop) {
  const auto compute = [session, stop]() -> absl::Status {
    std::stop_source source;
    const auto end = [&source] { source.request_stop(); };
    const std::stop_callback stopping(stop, end), closing(session->closing(), end);
    const Stop either(source.get_token());
    POLYEST_RETURN_IF_ERROR(session->Process(either));
    return session->observed() ? session->LatestEstimate(either).status() : absl::OkStatus();
  };
  // If the task is refused or fails, the work is left to whoever asks next.
  session->strand().Submit([compute] { Guarded(compute).IgnoreError(); }).IgnoreError();
}

}  // namespace polyest::internal
