#pragma once

// StreamMeasurements: batches in, acknowledgements and estimates out.
//
// Reactions only move messages between gRPC and two bounded queues; the session's strand takes them
// from the one and puts its answers into the other, where they wait for the journal. The next
// message is read only while both have room, so that HTTP/2's flow control holds back a client that
// is too fast for the numerics or the disk, or too slow to read.

#include <grpcpp/support/server_callback.h>

#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include "polyest/v1/estimation_service.pb.h"
#include "server/service/call_stop.h"
#include "server/service/estimate_schedule.h"
#include "server/service/service_context.h"

namespace polyest {

using MeasurementReactor =
    grpc::ServerBidiReactor<v1::StreamMeasurementsRequest, v1::StreamMeasurementsResponse>;

// The state of one stream; outlives its reactor, for the strand may still hold it.
class MeasurementFlow final : public SessionObserver,
                              public Drainable,
                              public std::enable_shared_from_this<MeasurementFlow> {
 public:
  MeasurementFlow(ServiceContext& context, grpc::CallbackServerContext& call);

  // Again for each message: a token may be taken back while the stream is open.
  absl::StatusOr<Caller> Authorize() const;

  // The reactions, in the reactor's words.
  void OnStart(MeasurementReactor* reactor, const absl::Status& admitted);
  void OnRead(bool ok);
  void OnWritten(bool ok);
  void OnCancelled();
  void OnDone();

  // The session was deleted.
  void OnClosed() override;
  void OnReplaced() override;
  void OnEstimate(const SharedEstimate&) override {}
  // The daemon shuts down.
  void Drain() override;

 private:
  static constexpr size_t kLongestWriter = 64;
  static constexpr size_t kInbox = 8;
  static constexpr size_t kOutbox = 16;

  // All with the mutex held.
  void Take(v1::StreamMeasurementsRequest request);
  absl::Status Attach(const Caller& caller, const v1::StreamMeasurementsRequest& request);
  void End(const absl::Status& status);
  void Break(const absl::Status& status);
  // Starts whatever can be started: a write, a read, work, the end.
  void Advance();
  void StartWork();
  void FinishIfIdle();

  // On the strand, without the mutex.
  void Work();
  // One message; the answers go to the outbox.
  absl::Status Answer(const v1::StreamMeasurementsRequest& request, const Stop& stop);
  absl::Status AnswerLast(const Stop& stop);
  absl::Status SendEstimate(const Stop& stop);
  // Once everything up to batch `sequence` is kept.
  void Send(v1::StreamMeasurementsResponse response, int64_t sequence);
  void OnKept(int64_t sequence, const absl::Status& kept);

  ServiceContext& context_;
  grpc::CallbackServerContext& call_;  // until OnDone
  std::stop_source stop_source_;
  const CallStop stop_;
  EstimateSchedule schedule_;  // the strand's

  std::mutex mutex_;
  MeasurementReactor* reactor_ = nullptr;
  std::shared_ptr<Session> session_;  // set once, before any work
  v1::StreamMeasurementsRequest reading_into_;
  std::deque<v1::StreamMeasurementsRequest> inbox_;
  struct Answered {
    v1::StreamMeasurementsResponse response;
    int64_t sequence;  // of the batch that must be kept before
  };
  std::deque<Answered> outbox_;  // the first is being written, or next
  int64_t kept_ = 0;
  bool reading_ = false;
  bool writing_ = false;
  bool working_ = false;
  bool half_closed_ = false;
  bool draining_ = false;
  bool finished_ = false;
  std::optional<absl::Status> end_;  // how the stream ends, once the outbox is empty
};

class MeasurementStream final : public MeasurementReactor {
 public:
  MeasurementStream(ServiceContext& context, grpc::CallbackServerContext& call);

  void OnReadDone(bool ok) override { flow_->OnRead(ok); }
  void OnWriteDone(bool ok) override { flow_->OnWritten(ok); }
  void OnCancel() override { flow_->OnCancelled(); }
  void OnDone() override;

 private:
  std::shared_ptr<MeasurementFlow> flow_;
  std::unique_ptr<OpenCalls::Ticket> ticket_;
};

}  // namespace polyest
