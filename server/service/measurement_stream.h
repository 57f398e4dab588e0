#pragma once

// Serves StreamMeasurements: takes batches, sends acknowledgements and estimates.
//
// A message passes two stages, each of which runs on one thread at a time. First its batch is
// taken: it is checked and handed to the journal, and acknowledged when it is kept. A small batch
// is taken by gRPC's thread that has read it, any other one by a thread of the intake. Then its
// numerics are computed on the session's strand, which never delays an acknowledgement. Reactions
// only move messages between gRPC and bounded queues. The next message is read only while all
// queues have room, so that HTTP/2's flow control holds back a client that is too fast for the
// disk, far too fast for the numerics, or too slow to read. A stream to a session of another daemon
// is passed on to that.

#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include "polyest/v1/session_service.pb.h"
#include "server/service/call_stop.h"
#include "server/service/estimate_schedule.h"
#include "server/service/first_message_timer.h"
#include "server/service/service_context.h"
#include "server/service/stream_relay.h"

namespace polyest::internal {

using MeasurementReactor =
    grpc::ServerBidiReactor<v1::StreamMeasurementsRequest, v1::StreamMeasurementsResponse>;
using MeasurementRelay =
    StreamRelay<v1::StreamMeasurementsRequest, v1::StreamMeasurementsResponse, MeasurementReactor>;

// Holds the state of one stream. It outlives its reactor, because the strand may still hold it.
class MeasurementFlow final : public SessionObserver,
                              public Drainable,
                              public std::enable_shared_from_this<MeasurementFlow> {
 public:
  MeasurementFlow(ServiceContext& context, grpc::CallbackServerContext& call);

  // The following handle the reactor's events.
  void OnStart(MeasurementReactor* reactor, const absl::Status& admitted);
  void OnRead(bool ok);
  void OnWritten(bool ok);
  void OnCancelled();
  void OnDone();
  // Ends the stream if it has named no session.
  void OnFirstMessageDue();

  // Ends the stream NOT_FOUND, because the session was deleted.
  void OnClosed() override;
  // Ends the stream ABORTED, because the writer goes on with another connection.
  void OnReplaced() override;
  // Ends the stream UNAVAILABLE after a last estimate, because the session moves.
  void OnMoved() override { EndSoon(Moving()); }
  void OnEstimate(const SharedEstimate&) override {}
  // Ends the stream UNAVAILABLE after a last estimate, because the daemon shuts down.
  void Drain() override { EndSoon(ShuttingDown()); }

 private:
  static constexpr size_t kLongestWriter = 64;
  static constexpr size_t kInbox = 8;
  static constexpr size_t kOutbox = 64;
  // Largest number of batches that are acknowledged before they are computed. It is enough for the
  // pauses in which an expansion moves, at the pace of a rig.
  static constexpr size_t kMaxUncomputed = 256;
  // Largest message that gRPC's threads take themselves. It is taken within about 50 µs.
  static constexpr size_t kQuickBytes = 16 << 10;
  // Largest number of batches computed in one turn on the strand, because other sessions wait for
  // theirs.
  static constexpr size_t kTurn = 8;

  // A batch that was taken and is still to be computed.
  struct Uncomputed {
    int64_t sequence = 0;
    bool estimate = false;  // whether one is due after it
    int64_t bytes = 0;
  };
  // A response, and the batch that must be kept before it is sent.
  struct Answered {
    v1::StreamMeasurementsResponse response;
    int64_t sequence = 0;  // number of that batch
  };
  // Says how far the stream is with its session: it has none yet, or could not have it; looks for
  // it; brings it into memory; works with it; or has finished, because the call has ended or
  // another daemon serves it.
  enum class Stage { kNone, kFinding, kLoading, kReady, kFinished };
  enum class Writing { kNothingYet, kUnderWay, kDone };  // of responses

  void EndSoon(const absl::Status& reason);

  // The following are called with the mutex held.
  void Accept(v1::StreamMeasurementsRequest request);
  absl::Status Attach(const Caller& caller, const v1::StreamMeasurementsRequest& request);
  // Passes the stream on to the owner of its session, if `refusal` names one that may be asked.
  bool PassOn(const absl::Status& refusal);
  // Makes this the writer of the session.
  absl::Status Join(absl::StatusOr<std::shared_ptr<Session>> session, const std::string& writer);
  void End(const absl::Status& status);
  void Break(const absl::Status& status);
  // Starts whatever can be started: a write, a read, work, or the end of the call.
  void Advance();
  void StartWriting();
  void StartLoading();
  void StartTaking();
  void StartComputing();
  void FinishIfIdle();
  bool QueuesHaveRoom() const;
  bool MayRead() const;
  bool MayHoldMore() const;
  bool HasBatch() const;
  bool IsQuicklyTaken(const v1::StreamMeasurementsRequest& request) const;
  // Returns whether nothing is left to be taken and nothing will come.
  bool AllTaken() const;
  std::vector<Uncomputed> NextTurn();

  // The following are called without the mutex: Find on the executor, Load and Compute on the
  // strand, Take on a thread of the intake.
  void Find(const std::string& tenant, const std::string& session, const std::string& writer);
  void Load();
  void Take();
  void Compute();
  // Takes batches from the inbox, the oldest first, while they are of the choice. The mutex, which
  // `lock` holds, is free meanwhile.
  using Choice = std::function<bool(const v1::StreamMeasurementsRequest&)>;
  void TakeSome(std::unique_lock<std::mutex>& lock, const Choice& choice);
  void TakeOne(std::unique_lock<std::mutex>& lock);
  // Takes the batch of one message. Puts the acknowledgement into the outbox and returns what is
  // left to compute.
  absl::StatusOr<std::optional<Uncomputed>> Answer(const v1::StreamMeasurementsRequest& request);
  absl::Status ComputeTurn(const std::vector<Uncomputed>& turn, bool last);
  absl::Status SendEstimate(const Stop& stop);
  // Sends a response once everything up to batch `sequence` is kept.
  void Send(v1::StreamMeasurementsResponse response, int64_t sequence);
  void OnKept(int64_t sequence, const absl::Status& kept);

  ServiceContext& context_;
  grpc::CallbackServerContext& call_;  // valid until OnDone
  std::stop_source stop_source_;
  const CallStop stop_;
  EstimateSchedule schedule_;  // used while batches are taken
  FirstMessageTimer timer_;

  std::mutex mutex_;
  MeasurementReactor* reactor_ = nullptr;
  std::shared_ptr<PassedOnStream> passed_on_;  // set if another daemon owns the session
  std::shared_ptr<Session> session_;           // set once, before any work
  uint64_t losses_ = 0;                        // losses of the session when the stream began
  v1::StreamMeasurementsRequest reading_into_;
  std::deque<v1::StreamMeasurementsRequest> inbox_;
  std::deque<Uncomputed> uncomputed_;
  // Of the messages in the inbox and of batches not yet computed; none before the first message.
  std::optional<StreamMemory::Share> held_;
  std::list<Answered> outbox_;  // the first one is being written or is the next
  int64_t kept_ = 0;
  Stage stage_ = Stage::kNone;
  Writing writing_ = Writing::kNothingYet;
  // A message is read, batches are taken and batches are computed each on a thread of its own, all
  // at the same time.
  bool reading_ = false;
  bool taking_ = false;
  bool computing_ = false;
  bool half_closed_ = false;             // whether the client sends no more
  std::optional<absl::Status> drained_;  // why no more is read, if the daemon asks for the end
  std::optional<absl::Status> end_;      // how the stream ends, once the outbox is empty
  bool left_uncomputed_ = false;         // whether batches were not computed when it ended
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
