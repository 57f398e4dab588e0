#pragma once

// Runs the work of a unary call on the executor or on a session's strand.

#include <absl/status/statusor.h>
#include <google/protobuf/message.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>

#include "polyest/stop.h"
#include "server/execution/executor.h"
#include "server/service/open_calls.h"
#include "server/service/service_context.h"

namespace polyest::internal {

// The call is finished once: by its work, or by Start when the work is refused. Until then the
// request and the response of the call live, and the work may use them.
class UnaryCall final : public grpc::ServerUnaryReactor {
 public:
  using Finisher = std::function<void(const absl::Status&)>;
  // Does the work. If it returns an error, the call is finished with that. Otherwise the work calls
  // the finisher, before it returns or later, from any thread.
  using Work = std::function<absl::Status(const Stop&, Finisher)>;
  using Submit = std::function<absl::Status(Task)>;

  // Starts a call of a tenant whose work is handed to `submit` and fills `answer`, which gRPC owns.
  // Refuses it once the daemon shuts down, and as OpenCalls::Enter does.
  static grpc::ServerUnaryReactor* Start(const ServiceContext& service, const std::string& tenant,
                                         grpc::CallbackServerContext* context,
                                         const google::protobuf::Message* answer,
                                         const Submit& submit, Work work);

  void OnCancel() override;
  void OnDone() override;

 private:
  // Holds what outlives the reactor: the work may still be returning from Finish when OnDone comes.
  struct State {
    std::mutex mutex;
    UnaryCall* reactor = nullptr;
    const google::protobuf::Message* answer = nullptr;
    bool finished = false;
    std::stop_source stop;
  };

  static void Finish(State& state, const absl::Status& status);

  std::shared_ptr<State> state_ = std::make_shared<State>();
  std::unique_ptr<OpenCalls::Ticket> ticket_;
};

// Finishes a call that needs no work.
grpc::ServerUnaryReactor* FinishAtOnce(grpc::CallbackServerContext* context,
                                       const absl::Status& status);

// Puts the answer into `response` and returns OK, or returns the error that came instead of it.
template <typename Response>
absl::Status Deliver(absl::StatusOr<Response> answer, Response* response) {
  if (!answer.ok()) return std::move(answer).status();
  *response = *std::move(answer);
  return absl::OkStatus();
}

}  // namespace polyest::internal
