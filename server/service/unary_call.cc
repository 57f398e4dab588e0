#include "server/service/unary_call.h"

#include "core/common/status.h"
#include "server/execution/guarded.h"
#include "server/service/passed_on.h"
#include "server/service/status_mapping.h"

namespace polyest::internal {
namespace {

// Number of times that the database is asked who owns the session.
constexpr int kAttempts = 3;

}  // namespace

grpc::ServerUnaryReactor* UnaryCall::Start(const ServiceContext& service, const std::string& tenant,
                                           const Call& call, UnaryCall::Submit submit, Work work) {
  auto ticket = service.calls.Enter(OpenCalls::Kind::kUnary, tenant);
  if (!ticket.ok()) return FinishAtOnce(call.context, ticket.status());
  const std::shared_ptr<State> state(new State{
      .service = service, .call = call, .submit = std::move(submit), .work = std::move(work)});
  auto* const reactor = new UnaryCall(state);
  reactor->ticket_ = *std::move(ticket);
  state->reactor = reactor;
  SubmitWork(state);
  return reactor;
}

void UnaryCall::SubmitWork(const std::shared_ptr<State>& state) {
  const absl::Status accepted = state->submit([state] { Run(state); });
  if (!accepted.ok()) Finish(*state, ToGrpc(accepted));
}

void UnaryCall::Run(const std::shared_ptr<State>& state) {
  ++state->attempts;
  const Stop stop = state->call_stop.Begin();
  const auto finish = [state](const absl::Status& outcome) {
    End(state, state->call_stop.Name(outcome));
  };
  absl::Status status = stop.Check();
  if (status.ok()) status = state->reactor->ticket_->HoldAnswer(state->call.answer_bytes);
  if (status.ok()) status = Guarded([&] { return state->work(stop, state->stop, finish); });
  if (!status.ok()) finish(status);
}

void UnaryCall::End(const std::shared_ptr<State>& state, const absl::Status& status) {
  if (const NodeForwarder* const nodes = state->service.nodes; nodes != nullptr && !status.ok()) {
    std::optional<NodeForwarder::Passage> passage = nodes->PassageFor(*state->call.context, status);
    if (passage) return PassOn(state, *std::move(passage));
  }
  Finish(*state, ToGrpc(status));
}

void UnaryCall::PassOn(const std::shared_ptr<State>& state, NodeForwarder::Passage passage) {
  const auto on_end = [state, owner = passage.owner](const grpc::ClientContext& context,
                                                     const grpc::Status& outcome) {
    // If the owner has let go of the session, the database knows the next one.
    const bool again =
        IsOwnedElsewhere(outcome) || (state->call.anywhere && IsUnreached(context, outcome));
    if (again && state->attempts < kAttempts) return SubmitWork(state);
    PassOnTrailers(context, *state->call.context);
    Finish(*state, OutcomeFrom(owner, context, outcome));
  };
  NodeForwarder::Call(std::move(passage), PathOf(state->call.method), state->call.request,
                      state->call.answer, on_end);
}

void UnaryCall::Finish(State& state, const grpc::Status& status) {
  const std::lock_guard lock(state.mutex);
  if (std::exchange(state.finished, true)) return;
  absl::Status held;
  if (status.ok()) {
    const size_t bytes = state.call.answer->ByteSizeLong();
    held = state.reactor->ticket_->HoldAnswer(static_cast<int64_t>(bytes));
    if (!held.ok()) state.call.answer->Clear();
  }
  state.reactor->grpc::ServerUnaryReactor::Finish(held.ok() ? status : ToGrpc(held));
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
