#pragma once

// StreamMeasurements: batches in, acknowledgements and estimates out.
//
// A message goes through two stages, each of one thread at a time. Its batch is taken: checked, and
// handed to the journal; it is acknowledged when it is kept. Then its numerics are computed on the
// session's strand, which never delays an acknowledgement. Reactions only move messages between
// gRPC and bounded queues. The next message is read only while all have room, so that HTTP/2's flow
// control holds back a client that is too fast for the disk, far too fast for the numerics, or too
// slow to read.

#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include "polyest/v1/session_service.pb.h"
#include "server/service/call_stop.h"
#include "server/service/estimate_schedule.h"
#include "server/service/service_context.h"

namespace polyest::internal {

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
  static constexpr size_t kOutbox = 64;
  // Batches acknowledged before they are computed: enough for the pauses in which an expansion
  // moves, at the pace of a rig.
  static constexpr size_t kMaxUncomputed = 256;
  // Of one turn on the strand: other sessions wait for theirs.
  static constexpr size_t kTurn = 8;

  // A batch taken and to be computed.
  struct Uncomputed {
    int64_t sequence = 0;
    bool estimate = false;  // whether one is due after it
  };
  struct Answered {
    v1::StreamMeasurementsResponse response;
    int64_t sequence = 0;  // of the batch that must be kept before
  };
  enum class Stage { kNone, kLoading, kReady };

  // All with the mutex held.
  void Accept(v1::StreamMeasurementsRequest request);
  absl::Status Attach(const Caller& caller, const v1::StreamMeasurementsRequest& request);
  void End(const absl::Status& status);
  void Break(const absl::Status& status);
  // Starts whatever can be started: a write, a read, work, the end.
  void Advance();
  void StartLoading();
  void StartTaking();
  void StartComputing();
  void FinishIfIdle();
  bool HasRoom() const;
  // Nothing is left to be taken, and nothing will come.
  bool AllTaken() const;
  std::vector<Uncomputed> NextTurn();

  // Without the mutex: on the strand, on the intake's threads, on the strand.
  void Load();
  void Take();
  void Compute();
  // One message; the acknowledgement goes to the outbox, what it leaves to compute is returned.
  absl::StatusOr<std::optional<Uncomputed>> Answer(const v1::StreamMeasurementsRequest& request);
  absl::Status ComputeTurn(const std::vector<Uncomputed>& turn, bool last);
  absl::Status SendEstimate(const Stop& stop);
  // Once everything up to batch `sequence` is kept.
  void Send(v1::StreamMeasurementsResponse response, int64_t sequence);
  void OnKept(int64_t sequence, const absl::Status& kept);

  ServiceContext& context_;
  grpc::CallbackServerContext& call_;  // until OnDone
  std::stop_source stop_source_;
  const CallStop stop_;
  EstimateSchedule schedule_;  // of the taking

  std::mutex mutex_;
  MeasurementReactor* reactor_ = nullptr;
  std::shared_ptr<Session> session_;  // set once, before any work
  uint64_t losses_ = 0;               // of the session, when the stream began
  v1::StreamMeasurementsRequest reading_into_;
  std::deque<v1::StreamMeasurementsRequest> inbox_;
  std::deque<Uncomputed> uncomputed_;
  std::list<Answered> outbox_;  // the first is being written, or next
  int64_t kept_ = 0;
  Stage stage_ = Stage::kNone;
  bool reading_ = false;
  bool writing_ = false;
  bool taking_ = false;
  bool computing_ = false;
  bool half_closed_ = false;
  bool draining_ = false;
  bool finished_ = false;
  bool left_uncomputed_ = false;
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

}  // namespace polyest::internal
