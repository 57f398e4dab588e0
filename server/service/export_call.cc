#include "server/service/export_call.h"

#include <absl/strings/str_cat.h>

#include <iterator>
#include <utility>

#include "core/common/status.h"
#include "proto/wire/operations/names.h"
#include "server/service/guarded.h"
#include "server/service/status_mapping.h"

namespace polyest::internal {

void ExportFlow::OnStart(ExportReactor* reactor, const absl::StatusOr<Caller>& admitted,
                         const std::string& session) {
  const std::lock_guard lock(mutex_);
  reactor_ = reactor;
  const absl::Status begun = admitted.ok() ? Begin(*admitted, session) : admitted.status();
  if (!begun.ok()) End(begun);
  Advance();
}

absl::Status ExportFlow::Begin(const Caller& caller, const std::string& session) {
  POLYEST_RETURN_IF_ERROR(ResourceId("name", "sessions", session).status());
  POLYEST_ASSIGN_OR_RETURN(auto found, context_.sessions.Get(caller.tenant, session));
  export_ = std::make_unique<SessionExport>(std::move(found));
  lane_ = absl::StrCat(caller.tenant, "/calls");
  return StartReading();
}

absl::Status ExportFlow::StartReading() {
  reading_ = true;
  const absl::Status accepted =
      context_.executor.Submit(lane_, [flow = shared_from_this()] { flow->Read(); });
  if (!accepted.ok()) reading_ = false;
  return accepted;
}

void ExportFlow::Read() {
  absl::StatusOr<std::vector<v1::SessionRecord>> next;
  const absl::Status read = Guarded([&] {
    next = export_->Next();
    return next.status();
  });
  const std::lock_guard lock(mutex_);
  reading_ = false;
  if (!read.ok()) {
    End(read);
  } else if (next->empty()) {
    End(absl::OkStatus());
  } else if (!end_) {
    records_.insert(records_.end(), std::make_move_iterator(next->begin()),
                    std::make_move_iterator(next->end()));
  }
  Advance();
}

void ExportFlow::OnWritten(bool ok) {
  const std::lock_guard lock(mutex_);
  writing_ = false;
  records_.pop_front();
  if (!ok) {
    End(absl::CancelledError("the client does not read any more"));
    records_.clear();
  }
  Advance();
}

void ExportFlow::OnCancelled() {
  const std::lock_guard lock(mutex_);
  End(absl::CancelledError("the call was cancelled"));
  Advance();
}

void ExportFlow::Drain() {
  const std::lock_guard lock(mutex_);
  End(ShuttingDown());
  Advance();
}

// Sets how the export ends. After an error, records that wait are dropped; the one being written
// belongs to gRPC until OnWritten. An end in good order writes the rest first.
void ExportFlow::End(const absl::Status& status) {
  if (!end_) end_ = status;
  if (status.ok()) return;
  while (records_.size() > (writing_ ? 1 : 0)) records_.pop_back();
}

void ExportFlow::Advance() {
  if (finished_ || reactor_ == nullptr || writing_ || reading_) return;
  if (!records_.empty()) {
    writing_ = true;
    reactor_->StartWrite(&records_.front());
    return;
  }
  if (!end_) {
    const absl::Status accepted = StartReading();
    if (accepted.ok()) return;
    End(accepted);
  }
  finished_ = true;
  reactor_->Finish(ToGrpc(*end_));
}

void ExportFlow::OnDone() {
  const std::lock_guard lock(mutex_);
  reactor_ = nullptr;
}

ExportCall::ExportCall(ServiceContext& context, const grpc::CallbackServerContext& call,
                       const std::string& session)
    : flow_(std::make_shared<ExportFlow>(context)) {
  absl::StatusOr<Caller> admitted = context.access.Authorize(call, "ExportSession");
  if (admitted.ok()) {
    auto ticket = context.calls.Enter(OpenCalls::Kind::kWatcher, admitted->tenant, flow_);
    if (ticket.ok()) {
      ticket_ = *std::move(ticket);
    } else {
      admitted = ticket.status();
    }
  }
  flow_->OnStart(this, admitted, session);
}

void ExportCall::OnDone() {
  flow_->OnDone();
  delete this;
}

}  // namespace polyest::internal
