#pragma once

// A unary call whose work runs on the executor or on a session's strand.

#include <absl/status/statusor.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <utility>

#include "polyest/stop.h"
#include "server/execution/executor.h"
#include "server/service/open_calls.h"
#include "server/service/service_context.h"

namespace polyest::internal {

// Only the work finishes the call (or Start, when the work is refused), once; until then the
// request and the response of the call live, and the work may use them.
class UnaryCall final : public grpc::ServerUnaryReactor {
 public:
  using Finisher = std::function<void(const absl::Status&)>;
  // The call is finished with the answer when that is not OK; otherwise by the finisher, then or
  // later, from any thread.
  using Work = std::function<absl::Status(const Stop&, Finisher)>;
  using Submit = std::function<absl::Status(Task)>;

  static grpc::ServerUnaryReactor* Start(const ServiceContext& service,
                                         grpc::CallbackServerContext* context, const Submit& submit,
                                         Work work);

  void OnCancel() override;
  void OnDone() override;

 private:
  // What outlives the reactor: the work may still be returning from Finish when OnDone comes.
  struct State {
    std::mutex mutex;
    UnaryCall* reactor = nullptr;
    bool finished = false;
    std::stop_source stop;
  };

  static void Finish(State& state, const absl::Status& status);

  std::shared_ptr<State> state_ = std::make_shared<State>();
  std::unique_ptr<OpenCalls::Ticket> ticket_;
};

// A call that needs no work is finished at once.
grpc::ServerUnaryReactor* FinishAtOnce(grpc::CallbackServerContext* context,
                                       const absl::Status& status);

// Puts the answer, if there is one, where the call wants it.
template <typename Response>
absl::Status Deliver(absl::StatusOr<Response> answer, Response* response) {
  if (!answer.ok()) return std::move(answer).status();
  *response = *std::move(answer);
  return absl::OkStatus();
}

}  // namespace polyest::internal
