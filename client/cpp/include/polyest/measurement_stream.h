#pragma once

// Batches of measurements into a session, estimates out, over a connection that may break.
//
// A batch is kept until the daemon has acknowledged it. When the connection breaks, the next Send
// or Finish connects again, asks for the last batch that the session has, and sends what came
// after. So nothing is lost and nothing is counted twice. The same when the daemon has no room now
// but says that it may have later (its disk is full, it is busy), and when the token was exchanged.
// Open, too, tries again while the daemon is not reached.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "polyest/client.h"

namespace polyest {

// How a stream sends and connects again.
struct MeasurementStreamOptions {
  // Send waits while this many batches are not acknowledged, ≥ 1.
  int max_unacknowledged = 16;
  // How often estimates are wanted; none: after every batch.
  std::optional<v1::StreamMeasurementsRequest::EstimatePolicy> estimates;
  // Before the first attempt to connect again; doubles from one attempt to the next.
  std::chrono::milliseconds first_delay{100};
  // Up to this delay.
  std::chrono::milliseconds max_delay{5'000};
  // Attempts to reach the daemon without an acknowledgement in between, ≥ 0; then the stream fails.
  // While the daemon answers, and asks to try later, it is tried without end.
  int max_attempts = 16;
  // Waits so long; false: give up, the stream then fails. Null: sleeps.
  std::function<bool(std::chrono::milliseconds)> wait = nullptr;
};

// What a stream tells, each of them optional. Called from a thread of gRPC, one at a time, except
// `connection`: from within Open, Send and Finish.
struct MeasurementStreamCallbacks {
  // A new estimate, as often as MeasurementStreamOptions::estimates says.
  std::function<void(const v1::Estimate&)> estimate;
  // The daemon has stored batches up to a sequence number.
  std::function<void(const v1::Acknowledgement&)> acknowledgement;
  // Receives one sentence on a connection that fails or is back, or a daemon that has no room, or
  // again.
  std::function<void(const std::string&)> connection;
};

// For one thread. After a function has failed, the stream is of no more use.
class MeasurementStream {
 public:
  // `session` is `sessions/{id}` and exists; `client` outlives the stream.
  MeasurementStream(Client& client, std::string session, MeasurementStreamOptions options,
                    MeasurementStreamCallbacks callbacks);
  // Drops what is under way.
  ~MeasurementStream();
  MeasurementStream(const MeasurementStream&) = delete;
  MeasurementStream& operator=(const MeasurementStream&) = delete;

  // Connects; once, before anything else. Batches are numbered on from the session's last.
  // NOT_FOUND: no such session. UNAVAILABLE: no connection after all attempts.
  absl::Status Open();
  // Hands over one batch; waits while too many are not acknowledged. DATA_LOSS: the daemon has lost
  // the session. UNAVAILABLE: no connection after all attempts.
  absl::Status Send(v1::Measurements batch);
  // No more batches: waits for all acknowledgements and the last estimate, none if the session has
  // no samples.
  absl::StatusOr<std::optional<v1::Estimate>> Finish();

 private:
  class Connection;
  using Lock = std::unique_lock<std::mutex>;

  absl::Status Connect();
  absl::Status ConnectAgain(Lock& lock, absl::Status status);
  absl::Status Recover(Lock& lock);
  bool MayRecover(const absl::Status& status) const;
  std::string CountAttempt(const absl::Status& status);
  void TellOfRoom(Lock& lock);
  absl::Status ForgetAcknowledged(int64_t sequence);
  void Write();
  void Take(const v1::StreamMeasurementsResponse& response);
  bool Wait(std::chrono::milliseconds delay) const;
  void Tell(const std::string& sentence) const;

  Client& client_;
  const std::string session_;
  const std::string writer_;  // by which the daemon knows the next connection for this stream's
  const MeasurementStreamOptions options_;
  const MeasurementStreamCallbacks callbacks_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::unique_ptr<Connection> connection_;
  // Not acknowledged, in order; the first `written_` were handed to the present connection.
  std::deque<std::shared_ptr<const v1::StreamMeasurementsRequest>> pending_;
  size_t written_ = 0;
  int64_t last_sequence_ = 0;  // of the last batch handed over
  int attempts_ = 0;  // to reach the daemon, since the last acknowledgement or other answer
  int refusals_ = 0;  // for want of room, since the last acknowledgement
  bool told_of_refusal_ = false;
  bool finishing_ = false;
  std::optional<v1::Estimate> last_estimate_;
};

}  // namespace polyest
