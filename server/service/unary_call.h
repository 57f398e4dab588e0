#pragma once

// Runs the work of a unary call on the executor or on a session's strand, or passes the call on to
// the daemon that owns the session.

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
#include "server/security/method_roles.h"
#include "server/service/call_stop.h"
#include "server/service/open_calls.h"
#include "server/service/service_context.h"

namespace polyest::internal {

// The call is finished once: by its work, or by Start when the work is refused. Until then the
// request and the response of the call live, and the work may use them.
class UnaryCall final : public grpc::ServerUnaryReactor {
 public:
  using Finisher = std::function<void(const absl::Status&)>;
  // Does the work until the Stop ends it, which the work may ask for by the source. If it returns
  // an error, the call is finished with that. Otherwise the work calls the finisher, before it
  // returns or later, from any thread.
  using Work = std::function<absl::Status(const Stop&, std::stop_source&, Finisher)>;
  using Submit = std::function<absl::Status(Task)>;
  // Names what gRPC calls, and owns until the call is finished.
  struct Call {
    grpc::CallbackServerContext* context;
    Method method;
    const google::protobuf::Message* request;
    google::protobuf::Message* answer;
    // Whether this daemon can do the work itself if the one that it is passed on to does not
    // answer.
    bool anywhere = false;
    // The most bytes that the answer may have if the work changes something: room for them is taken
    // before the work, which must not be done and then refused its answer. 0: the work changes
    // nothing, or its answer is small.
    int64_t answer_bytes = 0;
  };

  // Starts a call of a tenant whose work is handed to `submit` and fills the answer. Work that is
  // refused because another daemon owns the session is that daemon's; if it has let go meanwhile,
  // the work is submitted again. Refuses the call once the daemon shuts down, and as
  // OpenCalls::Enter does.
  static grpc::ServerUnaryReactor* Start(const ServiceContext& service, const std::string& tenant,
                                         const Call& call, Submit submit, Work work);

  void OnCancel() override;
  void OnDone() override;

 private:
  // Holds what outlives the reactor: the work may still be returning from Finish when OnDone comes.
  struct State {
    std::mutex mutex{};
    UnaryCall* reactor = nullptr;
    bool finished = false;
    const ServiceContext& service;
    const Call call;
    const Submit submit;
    const Work work;
    std::stop_source stop{};
    const CallStop call_stop{*call.context, stop.get_token(), service.max_computing};
    int attempts = 0;  // to run the work; used by one thread at a time
  };

  explicit UnaryCall(std::shared_ptr<State> state) : state_(std::move(state)) {}

  static void SubmitWork(const std::shared_ptr<State>& state);
  static void Run(const std::shared_ptr<State>& state);
  // Ends the work: finishes the call, or passes it on.
  static void End(const std::shared_ptr<State>& state, const absl::Status& status);
  static void PassOn(const std::shared_ptr<State>& state, NodeForwarder::Passage passage);
  static void Finish(State& state, const grpc::Status& status);

  const std::shared_ptr<State> state_;
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
