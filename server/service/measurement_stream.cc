#include "server/service/measurement_stream.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "server/operations/names.h"
#include "server/service/guarded.h"
#include "server/service/status_mapping.h"

namespace polyest {

MeasurementFlow::MeasurementFlow(ServiceContext& context, grpc::CallbackServerContext& call)
    : context_(context),
      call_(call),
      stop_(call, stop_source_.get_token(), context.most_computing) {}

absl::StatusOr<Caller> MeasurementFlow::Authorize() const {
  POLYEST_ASSIGN_OR_RETURN(Caller caller, context_.access.Authorize(call_, "StreamMeasurements"));
  if (session_ != nullptr && session_->tenant() != caller.tenant) {
    return absl::PermissionDeniedError("the token is another tenant's now");
  }
  return caller;
}

void MeasurementFlow::OnStart(MeasurementReactor* reactor, const absl::Status& admitted) {
  std::lock_guard lock(mutex_);
  reactor_ = reactor;
  if (!admitted.ok()) End(admitted);
  Advance();
}

void MeasurementFlow::OnRead(bool ok) {
  std::lock_guard lock(mutex_);
  reading_ = false;
  if (!ok) {
    half_closed_ = true;
    if (session_ == nullptr) {
      End(absl::InvalidArgumentError("session: the first message of a stream must name one"));
    }
  } else if (!draining_ && !end_) {
    Take(std::move(reading_into_));
  }
  Advance();
}

void MeasurementFlow::Take(v1::StreamMeasurementsRequest request) {
  const absl::StatusOr<Caller> caller = Authorize();
  if (!caller.ok()) return End(caller.status());
  if (const absl::Status attached = Attach(*caller, request); !attached.ok()) return End(attached);
  inbox_.push_back(std::move(request));
}

absl::Status MeasurementFlow::Attach(const Caller& caller,
                                     const v1::StreamMeasurementsRequest& request) {
  if (session_ != nullptr) {
    if (request.session().empty() || request.session() == session_->name()) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrFormat("session: \"%s\" is not the stream's own, %s",
                                                      request.session(), session_->name()));
  }
  POLYEST_RETURN_IF_ERROR(ResourceId("session", "sessions", request.session()).status());
  if (request.writer().size() > kLongestWriter) {
    return absl::InvalidArgumentError(absl::StrFormat("writer: %d characters are more than %d",
                                                      request.writer().size(), kLongestWriter));
  }
  POLYEST_ASSIGN_OR_RETURN(auto session, context_.sessions.Get(caller.tenant, request.session()));
  POLYEST_RETURN_IF_ERROR(session->ClaimWriter(shared_from_this(), request.writer()));
  session_ = std::move(session);
  return absl::OkStatus();
}

void MeasurementFlow::OnWritten(bool ok) {
  std::lock_guard lock(mutex_);
  writing_ = false;
  outbox_.pop_front();
  if (!ok) Break(absl::CancelledError("the client does not read any more"));
  Advance();
}

void MeasurementFlow::OnCancelled() {
  std::lock_guard lock(mutex_);
  Break(absl::CancelledError("the call was cancelled"));
  Advance();
}

void MeasurementFlow::OnClosed() {
  std::lock_guard lock(mutex_);
  stop_source_.request_stop();
  End(absl::NotFoundError(absl::StrFormat("%s has been deleted", session_->name())));
  Advance();
}

void MeasurementFlow::OnReplaced() {
  std::lock_guard lock(mutex_);
  Break(absl::AbortedError("the writer goes on with another connection"));
  Advance();
}

void MeasurementFlow::Drain() {
  std::lock_guard lock(mutex_);
  draining_ = true;
  if (session_ == nullptr) End(ShuttingDown());
  Advance();
}

// What was received and not acknowledged is left to the client to send again.
void MeasurementFlow::End(const absl::Status& status) {
  if (!end_) end_ = status;
  inbox_.clear();
}

// As End, when nothing can be sent any more.
void MeasurementFlow::Break(const absl::Status& status) {
  stop_source_.request_stop();
  End(status);
  // The first one belongs to gRPC while it is being written.
  while (outbox_.size() > (writing_ ? 1 : 0)) outbox_.pop_back();
}

void MeasurementFlow::Advance() {
  if (finished_ || reactor_ == nullptr) return;
  if (!writing_ && !outbox_.empty() && outbox_.front().sequence <= kept_) {
    writing_ = true;
    reactor_->StartWrite(&outbox_.front().response);
  }
  StartWork();
  if (!reading_ && !half_closed_ && !draining_ && !end_ && inbox_.size() < kInbox &&
      outbox_.size() < kOutbox) {
    reading_ = true;
    reactor_->StartRead(&reading_into_);
  }
  FinishIfIdle();
}

void MeasurementFlow::StartWork() {
  const bool last = half_closed_ || draining_;
  if (working_ || end_ || outbox_.size() >= kOutbox || (inbox_.empty() && !last)) return;
  working_ = true;
  const absl::Status accepted =
      session_->strand().Submit([flow = shared_from_this()] { flow->Work(); });
  if (accepted.ok()) return;
  working_ = false;
  End(accepted);
}

void MeasurementFlow::FinishIfIdle() {
  if (!end_ || working_ || writing_ || !outbox_.empty()) return;
  finished_ = true;
  // Before the client hears of the end: it may come back at once.
  if (session_ != nullptr) session_->ReleaseWriter(this);
  reactor_->Finish(ToGrpc(*end_));
}

void MeasurementFlow::OnDone() {
  std::lock_guard lock(mutex_);
  reactor_ = nullptr;
}

void MeasurementFlow::Work() {
  std::unique_lock lock(mutex_);
  // A turn takes what is there, and no more: other sessions wait for theirs.
  for (size_t turn = 0; turn < kInbox && !end_ && outbox_.size() < kOutbox; ++turn) {
    const bool last = inbox_.empty();
    if (last && !half_closed_ && !draining_) break;
    v1::StreamMeasurementsRequest request;
    if (!last) {
      request = std::move(inbox_.front());
      inbox_.pop_front();
    }
    const absl::Status at_end = half_closed_ ? absl::OkStatus() : ShuttingDown();
    lock.unlock();
    const Stop stop = stop_.Begin();
    const absl::Status answered =
        stop_.Name(Guarded([&] { return last ? AnswerLast(stop) : Answer(request, stop); }));
    lock.lock();
    if (!answered.ok()) End(answered);
    if (last) End(at_end);
    Advance();
  }
  working_ = false;
  Advance();
}

absl::Status MeasurementFlow::Answer(const v1::StreamMeasurementsRequest& request,
                                     const Stop& stop) {
  if (request.has_estimates()) POLYEST_RETURN_IF_ERROR(schedule_.Set(request.estimates()));
  if (!request.has_measurements()) {
    if (request.sequence() == 0) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrFormat("measurements: batch %d has none", request.sequence()));
  }
  v1::StreamMeasurementsResponse response;
  POLYEST_ASSIGN_OR_RETURN(*response.mutable_acknowledgement(),
                           session_->Add(request.sequence(), request.measurements(), stop));
  Send(std::move(response), request.sequence());
  POLYEST_RETURN_IF_ERROR(session_->Process(stop));
  if (schedule_.Due(EstimateSchedule::Clock::now())) return SendEstimate(stop);
  return absl::OkStatus();
}

absl::Status MeasurementFlow::AnswerLast(const Stop& stop) {
  return session_->taken().samples > 0 ? SendEstimate(stop) : absl::OkStatus();
}

absl::Status MeasurementFlow::SendEstimate(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const SharedEstimate estimate, session_->CurrentEstimate(stop));
  v1::StreamMeasurementsResponse response;
  *response.mutable_estimate() = *estimate;
  Send(std::move(response), estimate->sequence());
  return absl::OkStatus();
}

void MeasurementFlow::Send(v1::StreamMeasurementsResponse response, int64_t sequence) {
  {
    std::lock_guard lock(mutex_);
    outbox_.push_back({std::move(response), sequence});
  }
  session_->WhenKept(sequence, [flow = shared_from_this(), sequence](const absl::Status& kept) {
    flow->OnKept(sequence, kept);
  });
}

void MeasurementFlow::OnKept(int64_t sequence, const absl::Status& kept) {
  std::lock_guard lock(mutex_);
  if (kept.ok()) {
    kept_ = std::max(kept_, sequence);
  } else {
    End(kept);
    // What stands on batches that are lost is not to be told.
    while (!outbox_.empty() && outbox_.back().sequence > kept_) outbox_.pop_back();
  }
  Advance();
}

MeasurementStream::MeasurementStream(ServiceContext& context, grpc::CallbackServerContext& call)
    : flow_(std::make_shared<MeasurementFlow>(context, call)) {
  absl::Status admitted = flow_->Authorize().status();
  if (admitted.ok()) {
    auto ticket = context.calls.Enter(OpenCalls::Kind::kWriter, flow_);
    admitted = ticket.status();
    if (admitted.ok()) ticket_ = *std::move(ticket);
  }
  flow_->OnStart(this, admitted);
}

void MeasurementStream::OnDone() {
  flow_->OnDone();
  delete this;
}

}  // namespace polyest
