#include "server/service/measurement_stream.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "proto/wire/operations/names.h"
#include "server/service/catch_up.h"
#include "server/service/status_mapping.h"
#include "server/service/stream_admission.h"

namespace polyest::internal {

MeasurementFlow::MeasurementFlow(ServiceContext& context, grpc::CallbackServerContext& call)
    : context_(context),
      call_(call),
      stop_(call, stop_source_.get_token(), context.max_computing) {}

void MeasurementFlow::OnStart(MeasurementReactor* reactor, const absl::Status& admitted) {
  std::lock_guard lock(mutex_);
  reactor_ = reactor;
  if (admitted.ok()) {
    timer_.Start(context_.first_message, [flow = weak_from_this()] {
      if (const auto present = flow.lock()) present->OnFirstMessageDue();
    });
  } else {
    End(admitted);
  }
  Advance();
}

void MeasurementFlow::OnFirstMessageDue() {
  std::lock_guard lock(mutex_);
  if (session_ == nullptr) End(SaidNothing());
  Advance();
}

void MeasurementFlow::OnRead(bool ok) {
  std::unique_lock lock(mutex_);
  if (passed_on_ != nullptr) return passed_on_->OnRead(ok);
  reading_ = false;
  if (!ok) {
    half_closed_ = true;
    if (session_ == nullptr) {
      End(InvalidField("session", "the first message of a stream must name one"));
    }
  } else if (!drained_ && !end_) {
    Accept(std::move(reading_into_));
  }
  if (!taking_ && HasBatch() && IsQuicklyTaken(inbox_.front())) {
    TakeSome(lock, [this](const auto& request) { return IsQuicklyTaken(request); });
  } else {
    Advance();
  }
}

void MeasurementFlow::Accept(v1::StreamMeasurementsRequest request) {
  const absl::StatusOr<Caller> caller =
      AuthorizeStream(context_, call_, "StreamMeasurements", session_.get());
  if (!caller.ok()) return End(caller.status());
  if (const absl::Status attached = Attach(*caller, request); !attached.ok()) return End(attached);
  if (!held_) held_.emplace(context_.calls.memory(), caller->tenant);
  held_->Add(static_cast<int64_t>(request.ByteSizeLong()));
  inbox_.push_back(std::move(request));
}

absl::Status MeasurementFlow::Attach(const Caller& caller,
                                     const v1::StreamMeasurementsRequest& request) {
  if (session_ != nullptr) {
    if (request.session().empty() || request.session() == session_->name()) return absl::OkStatus();
    return InvalidField("session", absl::StrFormat("\"%s\" is not the stream's own, %s",
                                                   request.session(), session_->name()));
  }
  POLYEST_RETURN_IF_ERROR(ResourceId("session", "sessions", request.session()).status());
  if (request.writer().size() > kLongestWriter) {
    return InvalidField("writer", absl::StrFormat("%d characters are more than %d",
                                                  request.writer().size(), kLongestWriter));
  }
  timer_.Stop();
  if (!context_.sessions.shared()) {
    return Join(context_.sessions.Get(caller.tenant, request.session()), request.writer());
  }
  stage_ = Stage::kFinding;
  const absl::Status accepted = context_.executor.Submit(
      absl::StrCat(caller.tenant, "/sessions"),
      [flow = shared_from_this(), tenant = caller.tenant, session = request.session(),
       writer = request.writer()] { flow->Find(tenant, session, writer); });
  if (!accepted.ok()) stage_ = Stage::kNone;
  return accepted;
}

absl::Status MeasurementFlow::Join(absl::StatusOr<std::shared_ptr<Session>> session,
                                   const std::string& writer) {
  POLYEST_RETURN_IF_ERROR(session.status());
  POLYEST_RETURN_IF_ERROR((*session)->ClaimWriter(shared_from_this(), writer));
  losses_ = (*session)->losses();
  session_ = *std::move(session);
  return absl::OkStatus();
}

bool MeasurementFlow::PassOn(const absl::Status& refusal) {
  if (context_.nodes == nullptr || drained_ || refusal.ok()) return false;
  std::optional<NodeForwarder::Passage> passage = context_.nodes->PassageFor(call_, refusal);
  if (!passage) return false;
  stage_ = Stage::kFinished;
  // Nothing is being read, and the first message is the only one that has been.
  passed_on_ = MeasurementRelay::Start(*std::move(passage), PathOf("StreamMeasurements"), call_,
                                       reactor_, std::move(inbox_.front()));
  inbox_.clear();
  held_.reset();
  return true;
}

void MeasurementFlow::OnWritten(bool ok) {
  std::lock_guard lock(mutex_);
  if (passed_on_ != nullptr) return passed_on_->OnWritten(ok);
  writing_ = Writing::kDone;
  outbox_.pop_front();
  if (!ok) Break(absl::CancelledError("the client does not read any more"));
  Advance();
}

void MeasurementFlow::OnCancelled() {
  std::lock_guard lock(mutex_);
  if (passed_on_ != nullptr) return passed_on_->OnCancelled();
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

void MeasurementFlow::EndSoon(const absl::Status& reason) {
  std::lock_guard lock(mutex_);
  if (passed_on_ != nullptr) return passed_on_->Drain();
  if (!drained_) drained_ = reason;
  if (session_ == nullptr) End(reason);
  Advance();
}

// Sets how the stream ends. The client sends again what was received and not taken.
void MeasurementFlow::End(const absl::Status& status) {
  if (!end_) end_ = status;
  for (const auto& request : inbox_) held_->Add(-static_cast<int64_t>(request.ByteSizeLong()));
  for (const Uncomputed& one : uncomputed_) held_->Add(-one.bytes);
  inbox_.clear();
  left_uncomputed_ = left_uncomputed_ || computing_ || !uncomputed_.empty();
  uncomputed_.clear();
}

// Ends the stream when nothing can be sent any more: stops the work and empties the outbox.
void MeasurementFlow::Break(const absl::Status& status) {
  stop_source_.request_stop();
  End(status);
  // The first one belongs to gRPC while it is being written.
  while (outbox_.size() > (writing_ == Writing::kUnderWay ? 1 : 0)) outbox_.pop_back();
}

void MeasurementFlow::Advance() {
  if (stage_ == Stage::kFinished || reactor_ == nullptr) return;
  StartWriting();
  StartLoading();
  StartTaking();
  StartComputing();
  if (!reading_ && MayRead()) {
    reading_ = true;
    reactor_->StartRead(&reading_into_);
  }
  FinishIfIdle();
}

void MeasurementFlow::StartWriting() {
  const auto may_be_sent = [this](const Answered& answered) { return answered.sequence <= kept_; };
  if (writing_ == Writing::kUnderWay || outbox_.empty() || !may_be_sent(outbox_.front())) return;
  // The next response, if it is ready, goes into the same packet. The first one does not wait for
  // it: gRPC would keep that back, with the call's metadata, until the connection has something
  // else to send, and says that it is written only then.
  grpc::WriteOptions options;
  const bool first = writing_ == Writing::kNothingYet;
  if (!first && outbox_.size() > 1 && may_be_sent(*std::next(outbox_.begin()))) {
    options.set_buffer_hint();
  }
  writing_ = Writing::kUnderWay;
  reactor_->StartWrite(&outbox_.front().response, options);
}

bool MeasurementFlow::QueuesHaveRoom() const {
  return outbox_.size() < kOutbox && uncomputed_.size() < kMaxUncomputed;
}

bool MeasurementFlow::MayRead() const {
  return !half_closed_ && !drained_ && !end_ && stage_ != Stage::kFinding &&
         inbox_.size() < kInbox && MayHoldMore() && QueuesHaveRoom();
}

// A stream that holds nothing may always read a message, so that none waits for others.
bool MeasurementFlow::MayHoldMore() const {
  if (!held_ || held_->bytes() == 0) return true;
  return held_->bytes() < context_.held_bytes && held_->HasRoom();
}

bool MeasurementFlow::AllTaken() const {
  return (half_closed_ || drained_) && stage_ == Stage::kReady && !taking_ && inbox_.empty();
}

void MeasurementFlow::StartLoading() {
  if (end_ || session_ == nullptr || stage_ != Stage::kNone) return;
  // Acknowledgements of a session in memory do not wait for the numerics of others on the strand.
  stage_ = session_->ReadyToTake() ? Stage::kReady : Stage::kLoading;
  if (stage_ == Stage::kReady) return;
  const absl::Status accepted =
      session_->strand().Submit([flow = shared_from_this()] { flow->Load(); });
  if (accepted.ok()) return;
  stage_ = Stage::kNone;
  End(accepted);
}

bool MeasurementFlow::HasBatch() const {
  return !end_ && stage_ == Stage::kReady && !inbox_.empty() && QueuesHaveRoom();
}

// Returns whether taking the batch takes no longer than handing it to another thread. A batch that
// comes again waits for the journal, to be compared with what it was, and one of a journal that
// daemons share may wait until this daemon owns the session.
bool MeasurementFlow::IsQuicklyTaken(const v1::StreamMeasurementsRequest& request) const {
  return !context_.sessions.shared() && request.sequence() == session_->taken().sequence + 1 &&
         request.ByteSizeLong() <= kQuickBytes;
}

void MeasurementFlow::StartTaking() {
  if (taking_ || !HasBatch()) return;
  taking_ = true;
  // An open stream has one task here and one on the strand, and does not end because the queues are
  // full.
  context_.intake
      .Submit(
          session_->tenant(), [flow = shared_from_this()] { flow->Take(); }, Admission::kAlways)
      .IgnoreError();
}

void MeasurementFlow::StartComputing() {
  if (end_ || computing_ || outbox_.size() >= kOutbox) return;
  if (uncomputed_.empty() && !AllTaken()) return;
  computing_ = true;
  session_->strand()
      .Submit([flow = shared_from_this()] { flow->Compute(); }, Admission::kAlways)
      .IgnoreError();
}

void MeasurementFlow::FinishIfIdle() {
  const bool working =
      taking_ || computing_ || stage_ == Stage::kFinding || stage_ == Stage::kLoading;
  if (!end_ || working || writing_ == Writing::kUnderWay || !outbox_.empty()) return;
  stage_ = Stage::kFinished;
  // The lease is released before the client hears of the end, because the client may come back at
  // once.
  if (session_ != nullptr) session_->ReleaseWriter(this);
  if (left_uncomputed_ || !uncomputed_.empty()) CatchUp(session_, context_.stop);
  reactor_->Finish(ToGrpc(*end_));
}

void MeasurementFlow::OnDone() {
  std::lock_guard lock(mutex_);
  reactor_ = nullptr;
}

void MeasurementFlow::OnKept(int64_t sequence, const absl::Status& kept) {
  std::lock_guard lock(mutex_);
  if (kept.ok()) {
    kept_ = std::max(kept_, sequence);
  } else {
    End(kept);
    // Responses that depend on lost batches must not be sent.
    outbox_.remove_if([this](const Answered& answered) { return answered.sequence > kept_; });
  }
  Advance();
}

MeasurementStream::MeasurementStream(ServiceContext& context, grpc::CallbackServerContext& call)
    : flow_(std::make_shared<MeasurementFlow>(context, call)) {
  flow_->OnStart(this, AdmitStream(context, call, "StreamMeasurements", OpenCalls::Kind::kWriter,
                                   flow_, ticket_)
                           .status());
}

void MeasurementStream::OnDone() {
  flow_->OnDone();
  delete this;
}

}  // namespace polyest::internal
