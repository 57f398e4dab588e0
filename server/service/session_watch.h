#pragma once

// Serves WatchSession: sends every new estimate of a session to any number of observers. Between
// the session and an observer there is room for one estimate; a newer one replaces it, so that a
// slow observer misses those between but never the last. An observer may also ask for predictions
// of the signals, which are computed on the session's strand, at a rate that leaves nine tenths of
// the time to the estimates.

#include <grpcpp/support/server_callback.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include "polyest/v1/session_service.pb.h"
#include "server/service/call_stop.h"
#include "server/service/service_context.h"
#include "server/service/stream_relay.h"

namespace polyest::internal {

using WatchReactor = grpc::ServerWriteReactor<v1::WatchSessionResponse>;

// Holds the state of one watch. It outlives its reactor, because the session may still hold it.
class WatchFlow final : public SessionObserver,
                        public Drainable,
                        public std::enable_shared_from_this<WatchFlow> {
 public:
  WatchFlow(ServiceContext& context, grpc::CallbackServerContext& call);

  void OnStart(WatchReactor* reactor, const absl::StatusOr<Caller>& admitted,
               const v1::WatchSessionRequest& request);
  void OnWritten(bool ok);
  void OnCancelled();
  void OnDone();

  void OnEstimate(const SharedEstimate& estimate) override;
  void OnClosed() override;
  void OnMoved() override;
  void Drain() override;

 private:
  using Clock = std::chrono::steady_clock;

  // The following are called with the mutex held.
  absl::Status Attach(const Caller& caller, const v1::WatchSessionRequest& request);
  void End(const absl::Status& status);
  void EndForShutdown();
  // Ends the watch when nothing can be sent any more.
  void Break(const absl::Status& status);
  void Advance();
  // Writes the estimate, or else the prediction, that waits.
  void WriteNext();
  void PredictIfDue();

  // Computes a prediction; runs on the strand.
  void ComputePrediction();
  // Looks for the session; runs where a thread may wait for that.
  void Find(const std::string& tenant, const v1::WatchSessionRequest& request);
  // Passes the watch on to the owner of its session, if `refusal` names one that may be asked.
  // Called with the mutex held.
  bool PassOn(const absl::Status& refusal, const v1::WatchSessionRequest& request);
  // Makes the watch an observer of the session; runs on the strand.
  void Register();

  ServiceContext& context_;
  grpc::CallbackServerContext& call_;  // valid until OnDone
  std::stop_source stop_source_;
  const CallStop stop_;

  std::mutex mutex_;
  WatchReactor* reactor_ = nullptr;
  std::shared_ptr<PassedOnStream> passed_on_;  // set if another daemon owns the session
  std::shared_ptr<Session> session_;
  SharedEstimate pending_, last_;
  std::optional<v1::PredictRequest> wanted_;   // the prediction that is asked for, if any
  std::chrono::duration<double> interval_{0};  // from one prediction to the next, at least
  Clock::time_point due_{};                    // of the next prediction
  bool predicting_ = false;
  std::optional<v1::PredictResponse> prediction_;  // to be sent
  v1::WatchSessionResponse written_;               // belongs to gRPC while writing_ is set
  bool writing_ = false;
  bool registering_ = false;
  bool finished_ = false;
  std::optional<absl::Status> end_;  // how the watch ends, once nothing is pending
};

class SessionWatch final : public WatchReactor {
 public:
  SessionWatch(ServiceContext& context, grpc::CallbackServerContext& call,
               const v1::WatchSessionRequest& request);

  void OnWriteDone(bool ok) override { flow_->OnWritten(ok); }
  void OnCancel() override { flow_->OnCancelled(); }
  void OnDone() override;

 private:
  std::shared_ptr<WatchFlow> flow_;
  std::unique_ptr<OpenCalls::Ticket> ticket_;
};

}  // namespace polyest::internal
