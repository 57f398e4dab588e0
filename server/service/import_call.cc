#include "server/service/import_call.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "server/execution/guarded.h"
#include "server/service/status_mapping.h"
#include "server/service/stream_admission.h"

namespace polyest::internal {

void ImportFlow::OnStart(ImportReactor* reactor, const absl::StatusOr<Caller>& admitted) {
  const std::lock_guard lock(mutex_);
  reactor_ = reactor;
  if (admitted.ok()) {
    import_ = std::make_unique<SessionImport>(context_.sessions, admitted->tenant);
    lane_ = absl::StrCat(admitted->tenant, "/calls");
    timer_.Start(context_.first_message, [flow = weak_from_this()] {
      if (const auto present = flow.lock()) present->OnFirstMessageDue();
    });
  } else {
    End(admitted.status());
  }
  Advance();
}

void ImportFlow::OnRead(bool ok) {
  const std::lock_guard lock(mutex_);
  reading_ = false;
  half_closed_ = !ok;
  const bool first = !std::exchange(any_, true);
  if (first) timer_.Stop();
  if (!end_ && !finished_) {
    working_ = true;
    // A full queue refuses new imports, not those that have begun: each has one task at a time.
    const absl::Status accepted = context_.executor.Submit(
        lane_, [flow = shared_from_this()] { flow->Take(); },
        first ? Admission::kIfRoom : Admission::kAlways);
    if (!accepted.ok()) {
      working_ = false;
      End(accepted);
    }
  }
  Advance();
}

void ImportFlow::OnFirstMessageDue() {
  const std::lock_guard lock(mutex_);
  if (!any_) End(SaidNothing());
  Advance();
}

void ImportFlow::Take() {
  const absl::Status taken =
      Guarded([this] { return half_closed_ ? FinishImport() : TakeRequest(); });
  const std::lock_guard lock(mutex_);
  working_ = false;
  if (!taken.ok() || half_closed_) End(taken);
  Advance();
}

void ImportFlow::LeaveImport() {
  working_ = true;
  const absl::Status accepted = context_.executor.Submit(
      lane_,
      [flow = shared_from_this()] {
        flow->import_ = nullptr;
        const std::lock_guard lock(flow->mutex_);
        flow->working_ = false;
        flow->Advance();
      },
      Admission::kAlways);
  POLYEST_CHECK(accepted.ok());
}

absl::Status ImportFlow::TakeRequest() {
  return stop_.Name(import_->Take(request_, stop_.Begin()));
}

absl::Status ImportFlow::FinishImport() {
  {
    // If the client went away or the daemon shuts down, the end of the stream does not mean that
    // all records have come.
    const std::lock_guard lock(mutex_);
    if (end_) return *end_;
  }
  POLYEST_ASSIGN_OR_RETURN(const auto session, import_->Finish());
  *response_ = session->Describe();
  return absl::OkStatus();
}

void ImportFlow::OnCancelled() {
  const std::lock_guard lock(mutex_);
  End(absl::CancelledError("the call was cancelled"));
  Advance();
}

void ImportFlow::Drain() {
  const std::lock_guard lock(mutex_);
  End(ShuttingDown());
  Advance();
}

void ImportFlow::End(const absl::Status& status) {
  if (!end_) end_ = status;
  stop_source_.request_stop();
}

void ImportFlow::Advance() {
  if (finished_ || reactor_ == nullptr || working_) return;
  if (!end_) {
    if (!std::exchange(reading_, true)) reactor_->StartRead(&request_);
    return;
  }
  if (import_ != nullptr) {
    LeaveImport();
    return;
  }
  finished_ = true;
  reactor_->Finish(ToGrpc(*end_));
}

void ImportFlow::OnDone() {
  const std::lock_guard lock(mutex_);
  reactor_ = nullptr;
}

ImportCall::ImportCall(ServiceContext& context, const grpc::CallbackServerContext& call,
                       v1::Session* response)
    : flow_(std::make_shared<ImportFlow>(context, call, response)) {
  flow_->OnStart(
      this, AdmitStream(context, call, "ImportSession", OpenCalls::Kind::kWriter, flow_, ticket_));
}

void ImportCall::OnDone() {
  flow_->OnDone();
  delete this;
}

}  // namespace polyest::internal
