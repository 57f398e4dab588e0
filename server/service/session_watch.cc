#include "server/service/session_watch.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "core/common/status.h"
#include "proto/wire/operations/names.h"
#include "server/service/guarded.h"
#include "server/service/status_mapping.h"

namespace polyest::internal {

WatchFlow::WatchFlow(ServiceContext& context, grpc::CallbackServerContext& call)
    : context_(context),
      call_(call),
      stop_(call, stop_source_.get_token(), context.max_computing) {}

absl::StatusOr<Caller> WatchFlow::Authorize() const {
  POLYEST_ASSIGN_OR_RETURN(Caller caller, context_.access.Authorize(call_, "WatchSession"));
  if (session_ != nullptr && session_->tenant() != caller.tenant) {
    return absl::PermissionDeniedError("the token is another tenant's now");
  }
  return caller;
}

void WatchFlow::OnStart(WatchReactor* reactor, const absl::Status& admitted,
                        const std::string& session) {
  std::lock_guard lock(mutex_);
  reactor_ = reactor;
  const absl::Status attached = admitted.ok() ? Attach(session) : admitted;
  if (!attached.ok()) End(attached);
  Advance();
}

absl::Status WatchFlow::Attach(const std::string& session) {
  POLYEST_ASSIGN_OR_RETURN(const Caller caller, Authorize());
  POLYEST_RETURN_IF_ERROR(ResourceId("session", "sessions", session).status());
  POLYEST_ASSIGN_OR_RETURN(session_, context_.sessions.Get(caller.tenant, session));
  registering_ = true;
  const absl::Status accepted =
      session_->strand().Submit([flow = shared_from_this()] { flow->Register(); });
  if (!accepted.ok()) registering_ = false;
  return accepted;
}

void WatchFlow::Register() {
  const absl::Status observing =
      stop_.Name(Guarded([this] { return session_->Observe(shared_from_this(), stop_.Begin()); }));
  std::lock_guard lock(mutex_);
  registering_ = false;
  if (!observing.ok()) End(observing);
  Advance();
}

void WatchFlow::OnEstimate(const SharedEstimate& estimate) {
  std::lock_guard lock(mutex_);
  if (end_ || reactor_ == nullptr || estimate == last_) return;
  const absl::Status allowed = Authorize().status();
  if (allowed.ok()) {
    pending_ = last_ = estimate;
  } else {
    End(allowed);
  }
  Advance();
}

void WatchFlow::OnWritten(bool ok) {
  std::lock_guard lock(mutex_);
  writing_ = false;
  if (!ok) {
    End(absl::CancelledError("the client does not read any more"));
    pending_ = nullptr;
  }
  Advance();
}

void WatchFlow::OnCancelled() {
  std::lock_guard lock(mutex_);
  stop_source_.request_stop();
  End(absl::CancelledError("the call was cancelled"));
  pending_ = nullptr;
  Advance();
}

void WatchFlow::OnClosed() {
  std::lock_guard lock(mutex_);
  End(absl::NotFoundError(absl::StrCat(session_->name(), " has been deleted")));
  Advance();
}

void WatchFlow::Drain() {
  std::lock_guard lock(mutex_);
  End(ShuttingDown());
  Advance();
}

void WatchFlow::End(const absl::Status& status) {
  if (!end_) end_ = status;
}

void WatchFlow::Advance() {
  if (finished_ || reactor_ == nullptr || writing_) return;
  if (pending_ != nullptr) {
    *written_.mutable_estimate() = *std::exchange(pending_, nullptr);
    writing_ = true;
    reactor_->StartWrite(&written_);
    return;
  }
  if (!end_ || registering_) return;
  finished_ = true;
  if (session_ != nullptr) session_->Unobserve(this);
  reactor_->Finish(ToGrpc(*end_));
}

void WatchFlow::OnDone() {
  std::lock_guard lock(mutex_);
  reactor_ = nullptr;
}

SessionWatch::SessionWatch(ServiceContext& context, grpc::CallbackServerContext& call,
                           const std::string& session)
    : flow_(std::make_shared<WatchFlow>(context, call)) {
  absl::Status admitted = flow_->Authorize().status();
  if (admitted.ok()) {
    auto ticket = context.calls.Enter(OpenCalls::Kind::kWatcher, flow_);
    admitted = ticket.status();
    if (admitted.ok()) ticket_ = *std::move(ticket);
  }
  flow_->OnStart(this, admitted, session);
}

void SessionWatch::OnDone() {
  flow_->OnDone();
  delete this;
}

}  // namespace polyest::internal
