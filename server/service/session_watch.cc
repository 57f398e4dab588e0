#include "server/service/session_watch.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "proto/wire/operations/names.h"
#include "proto/wire/operations/operations.h"
#include "server/execution/guarded.h"
#include "server/service/status_mapping.h"
#include "server/service/stream_admission.h"

namespace polyest::internal {

namespace {

// Time from one prediction to the next ÷ time that one takes, at least.
constexpr int kRest = 10;

using PredictionPolicy = v1::WatchSessionRequest::PredictionPolicy;

v1::PredictRequest ToPredictRequest(const PredictionPolicy& policy) {
  constexpr int kDraws = 50, kRows = 200;
  v1::PredictRequest request;
  *request.mutable_outputs() = policy.outputs();
  request.set_draw_count(policy.draw_count() == 0 ? kDraws : policy.draw_count());
  request.set_max_row_count(policy.max_row_count() == 0 ? kRows : policy.max_row_count());
  request.set_forecast_s(policy.forecast_s());
  return request;
}

std::chrono::duration<double> IntervalOf(const PredictionPolicy& policy) {
  constexpr double kInterval = 1;
  return std::chrono::duration<double>(policy.min_interval_s() == 0 ? kInterval
                                                                    : policy.min_interval_s());
}

absl::Status CheckPolicy(const PredictionPolicy& policy) {
  static constexpr double kLongest = 86'400;
  const auto check = [](const char* field, double value_s) -> absl::Status {
    if (value_s >= 0 && value_s <= kLongest) return absl::OkStatus();
    return InvalidField(FieldPath{"prediction", field},
                        absl::StrFormat("%g must be from 0 to %g", value_s, kLongest));
  };
  POLYEST_RETURN_IF_ERROR(check("minIntervalS", policy.min_interval_s()));
  return check("forecastS", policy.forecast_s());
}

}  // namespace

WatchFlow::WatchFlow(ServiceContext& context, grpc::CallbackServerContext& call)
    : context_(context),
      call_(call),
      stop_(call, stop_source_.get_token(), context.max_computing) {}

void WatchFlow::OnStart(WatchReactor* reactor, const absl::StatusOr<Caller>& admitted,
                        const v1::WatchSessionRequest& request) {
  std::lock_guard lock(mutex_);
  reactor_ = reactor;
  if (request.has_prediction()) {
    wanted_ = ToPredictRequest(request.prediction());
    interval_ = IntervalOf(request.prediction());
  }
  absl::Status attached = admitted.status();
  if (attached.ok()) attached = CheckPolicy(request.prediction());
  if (attached.ok()) attached = Attach(*admitted, request);
  if (!attached.ok()) End(attached);
  Advance();
}

absl::Status WatchFlow::Attach(const Caller& caller, const v1::WatchSessionRequest& request) {
  const std::string& session = request.session();
  POLYEST_RETURN_IF_ERROR(ResourceId("session", "sessions", session).status());
  registering_ = true;
  if (context_.sessions.shared()) {
    const absl::Status looking =
        context_.executor.Submit(absl::StrCat(caller.tenant, "/sessions"),
                                 [flow = shared_from_this(), tenant = caller.tenant, request] {
                                   flow->Find(tenant, request);
                                 });
    if (!looking.ok()) registering_ = false;
    return looking;
  }
  auto found = context_.sessions.Get(caller.tenant, session);
  registering_ = found.ok();
  POLYEST_ASSIGN_OR_RETURN(session_, std::move(found));
  const absl::Status accepted =
      session_->strand().Submit([flow = shared_from_this()] { flow->Register(); });
  if (!accepted.ok()) registering_ = false;
  return accepted;
}

// Looks for the session where a thread may wait for that.
void WatchFlow::Find(const std::string& tenant, const v1::WatchSessionRequest& request) {
  auto found = Guarded([&] { return context_.sessions.Find(tenant, request.session()); });
  std::lock_guard lock(mutex_);
  absl::Status accepted = found.status();
  if (accepted.ok()) {
    session_ = *std::move(found);
    accepted = session_->strand().Submit([flow = shared_from_this()] { flow->Register(); });
  }
  if (accepted.ok()) return;
  registering_ = false;
  if (!end_ && PassOn(accepted, request)) return;
  End(accepted);
  Advance();
}

bool WatchFlow::PassOn(const absl::Status& refusal, const v1::WatchSessionRequest& request) {
  if (context_.nodes == nullptr) return false;
  std::optional<NodeForwarder::Passage> passage = context_.nodes->PassageFor(call_, refusal);
  if (!passage) return false;
  using Relay = StreamRelay<v1::WatchSessionRequest, v1::WatchSessionResponse, WatchReactor>;
  finished_ = true;
  passed_on_ = Relay::Start(*std::move(passage), PathOf("WatchSession"), call_, reactor_, request);
  return true;
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
  const absl::Status allowed =
      AuthorizeStream(context_, call_, "WatchSession", session_.get()).status();
  if (allowed.ok()) {
    pending_ = last_ = estimate;
    PredictIfDue();
  } else {
    End(allowed);
  }
  Advance();
}

void WatchFlow::PredictIfDue() {
  if (!wanted_ || predicting_ || Clock::now() < due_) return;
  // If the executor is full, a later estimate tries again.
  predicting_ =
      session_->strand().Submit([flow = shared_from_this()] { flow->ComputePrediction(); }).ok();
}

void WatchFlow::ComputePrediction() {
  const Clock::time_point begin = Clock::now();
  // Processing and predicting are one piece of work.
  const Stop stop = stop_.Begin();
  v1::PredictResponse prediction;
  const auto predict = [&](Estimator& estimator, int64_t sequence) -> absl::Status {
    POLYEST_ASSIGN_OR_RETURN(prediction, Predict(*wanted_, estimator, stop));
    prediction.set_sequence(sequence);
    return absl::OkStatus();
  };
  const absl::Status predicted =
      stop_.Name(Guarded([&] { return session_->WithEstimator(predict, stop); }));
  const Clock::time_point end = Clock::now();
  std::lock_guard lock(mutex_);
  predicting_ = false;
  due_ = std::max(begin + std::chrono::duration_cast<Clock::duration>(interval_),
                  begin + kRest * (end - begin));
  if (predicted.ok()) {
    if (!end_) prediction_ = std::move(prediction);
  } else if (absl::IsInvalidArgument(predicted) || absl::IsResourceExhausted(predicted)) {
    End(predicted);  // what was asked for cannot be predicted
  }
  Advance();
}

void WatchFlow::OnWritten(bool ok) {
  std::lock_guard lock(mutex_);
  if (passed_on_ != nullptr) return passed_on_->OnWritten(ok);
  writing_ = false;
  if (!ok) Break(absl::CancelledError("the client does not read any more"));
  Advance();
}

void WatchFlow::OnCancelled() {
  std::lock_guard lock(mutex_);
  if (passed_on_ != nullptr) return passed_on_->OnCancelled();
  Break(absl::CancelledError("the call was cancelled"));
  Advance();
}

void WatchFlow::OnClosed() {
  std::lock_guard lock(mutex_);
  End(absl::NotFoundError(absl::StrCat(session_->name(), " has been deleted")));
  Advance();
}

void WatchFlow::OnMoved() {
  std::lock_guard lock(mutex_);
  End(Moving());
  Advance();
}

void WatchFlow::Drain() {
  std::lock_guard lock(mutex_);
  if (passed_on_ != nullptr) return passed_on_->Drain();
  if (session_ == nullptr) return EndForShutdown();
  // The last estimates of the writers, which have ended before, may still be on their way.
  session_->AfterAnnounced([flow = shared_from_this()] {
    const std::lock_guard later(flow->mutex_);
    flow->EndForShutdown();
  });
}

void WatchFlow::EndForShutdown() {
  End(ShuttingDown());
  Advance();
}

void WatchFlow::End(const absl::Status& status) {
  if (!end_) end_ = status;
  stop_source_.request_stop();
}

void WatchFlow::Break(const absl::Status& status) {
  End(status);
  pending_ = nullptr;
  prediction_.reset();
}

void WatchFlow::Advance() {
  if (finished_ || reactor_ == nullptr || writing_) return;
  if (pending_ != nullptr || prediction_) return WriteNext();
  if (!end_ || registering_ || predicting_) return;
  finished_ = true;
  if (session_ != nullptr) session_->Unobserve(this);
  reactor_->Finish(ToGrpc(*end_));
}

void WatchFlow::WriteNext() {
  if (pending_ != nullptr) {
    written_.clear_prediction();
    *written_.mutable_estimate() = *std::exchange(pending_, nullptr);
  } else {
    written_.clear_estimate();
    *written_.mutable_prediction() = *std::exchange(prediction_, std::nullopt);
  }
  writing_ = true;
  reactor_->StartWrite(&written_);
}

void WatchFlow::OnDone() {
  std::lock_guard lock(mutex_);
  reactor_ = nullptr;
}

SessionWatch::SessionWatch(ServiceContext& context, grpc::CallbackServerContext& call,
                           const v1::WatchSessionRequest& request)
    : flow_(std::make_shared<WatchFlow>(context, call)) {
  flow_->OnStart(
      this, AdmitStream(context, call, "WatchSession", OpenCalls::Kind::kWatcher, flow_, ticket_),
      request);
}

void SessionWatch::OnDone() {
  flow_->OnDone();
  delete this;
}

}  // namespace polyest::internal
