#include "server/service/unary_call.h"

#include "core/common/status.h"
#include "server/service/call_stop.h"
#include "server/service/guarded.h"
#include "server/service/status_mapping.h"

namespace polyest::internal {

grpc::ServerUnaryReactor* UnaryCall::Start(const ServiceContext& service, const std::string& tenant,
                                           grpc::CallbackServerContext* context,
                                           const google::protobuf::Message* answer,
                                           const Submit& submit, Work work) {
  auto ticket = service.calls.Enter(OpenCalls::Kind::kUnary, tenant);
  if (!ticket.ok()) return FinishAtOnce(context, ticket.status());
  auto* call = new UnaryCall;
  call->ticket_ = *std::move(ticket);
  call->state_->reactor = call;
  call->state_->answer = answer;
  auto run = [state = call->state_, work = std::move(work),
              call_stop =
                  CallStop(*context, call->state_->stop.get_token(), service.max_computing)] {
    const Stop stop = call_stop.Begin();
    const auto finish = [state, call_stop](const absl::Status& outcome) {
      Finish(*state, call_stop.Name(outcome));
    };
    absl::Status status = stop.Check();
    if (status.ok()) status = Guarded([&] { return work(stop, finish); });
    if (!status.ok()) finish(status);
  };
  const absl::Status accepted = submit(std::move(run));
  if (!accepted.ok()) Finish(*call->state_, accepted);
  return call;
}

void UnaryCall::Finish(State& state, const absl::Status& status) {
  const std::lock_guard lock(state.mutex);
  if (std::exchange(state.finished, true)) return;
  if (status.ok()) {
    state.reactor->ticket_->HoldAnswer(static_cast<int64_t>(state.answer->ByteSizeLong()));
  }
  state.reactor->grpc::ServerUnaryReactor::Finish(ToGrpc(status));
}

void UnaryCall::OnCancel() { state_->stop.request_stop(); }

void UnaryCall::OnDone() {
  const std::shared_ptr<State> state = state_;
  const std::unique_ptr<OpenCalls::Ticket> ticket = std::move(ticket_);
  { std::lock_guard lock(state->mutex); }
  delete this;
}

grpc::ServerUnaryReactor* FinishAtOnce(grpc::CallbackServerContext* context,
                                       const absl::Status& status) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(ToGrpc(status));
  return reactor;
}

}  // namespace polyest::internal
