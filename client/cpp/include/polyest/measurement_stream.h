#pragma once

// Streams batches of measurements into a session and receives estimates, over a connection that may
// break.
//
// The stream keeps a batch until the daemon has acknowledged it. If the connection breaks, the next
// Send or Finish connects again and sends all batches that have no acknowledgement. The daemon
// recognizes those that had arrived, so no batch is lost or counted twice. The stream does the same
// if the daemon has no room now but says that it may have later (its disk is full, or it is busy),
// and if the token was replaced. Open also tries again while the daemon cannot be reached.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "polyest/client.h"

namespace polyest {

// Options for sending and for connecting again.
struct MeasurementStreamOptions {
  // Number of batches without acknowledgement at which Send waits, ≥ 1.
  int max_unacknowledged = 16;
  // Policy that says how often the daemon sends estimates; none: after every batch.
  std::optional<v1::StreamMeasurementsRequest::EstimatePolicy> estimates;
  // The delay before the first attempt to connect again; it doubles from one attempt to the next.
  std::chrono::milliseconds first_delay{100};
  // The longest such delay.
  std::chrono::milliseconds max_delay{2'000};
  // Attempts to reach the daemon without an acknowledgement in between, ≥ 0; then the stream fails.
  // While the daemon answers and asks to try later, the number of attempts is not limited.
  int max_attempts = 32;
  // Waits for the given time; returns false to give up. Null: sleeps.
  std::function<bool(std::chrono::milliseconds)> wait = nullptr;
};

// Functions that a stream calls; each may be left out. Those for estimates and acknowledgements are
// called from a thread of gRPC, one at a time; `connection` is called within Open, Send and Finish.
struct MeasurementStreamCallbacks {
  // Receives a new estimate, as often as MeasurementStreamOptions::estimates says.
  std::function<void(const v1::Estimate&)> estimate;
  // Receives the number up to which the daemon has stored all batches.
  std::function<void(const v1::Acknowledgement&)> acknowledgement;
  // Receives one sentence when the connection fails or is back, and when the daemon has no room or
  // has room again. A sentence is not repeated.
  std::function<void(const std::string&)> connection;
};

// A stream of batches. Use it from one thread; after a failure, make a new stream.
class MeasurementStream {
 public:
  // `session` is `sessions/{id}`, an existing session. `client` must outlive the stream.
  MeasurementStream(Client& client, std::string session, MeasurementStreamOptions options,
                    MeasurementStreamCallbacks callbacks);
  // Cancels the stream. Batches without an acknowledgement may be lost.
  ~MeasurementStream();
  MeasurementStream(const MeasurementStream&) = delete;
  MeasurementStream& operator=(const MeasurementStream&) = delete;

  // Connects. Call it once, before the other functions. Batches are numbered from the session's
  // last one on. NOT_FOUND: no such session. UNAVAILABLE: no connection after all attempts.
  absl::Status Open();
  // Sends one batch; waits while too many are not acknowledged. DATA_LOSS: the daemon has lost the
  // session or acknowledged batches of it. ABORTED: another client writes to the session.
  // UNAVAILABLE: no connection after all attempts.
  absl::Status Send(v1::Measurements batch);
  // Ends the stream: waits for all acknowledgements and returns the last estimate, or none if the
  // session has no samples. Fails as Send.
  absl::StatusOr<std::optional<v1::Estimate>> Finish();
  // Returns the batches that have no acknowledgement, in their order. If Send or Finish has failed
  // because the daemon refused a batch, that is the first of them.
  std::vector<v1::Measurements> Unacknowledged();

 private:
  class Connection;
  using Lock = std::unique_lock<std::mutex>;

  absl::Status Connect();
  absl::Status ConnectAgain(Lock& lock, absl::Status status);
  absl::Status Recover(Lock& lock);
  bool MayRecover(const absl::Status& status) const;
  std::string CountAttempt(const absl::Status& status);
  void TellOfRoom(Lock& lock);
  absl::Status CheckIsOwn(int64_t sequence) const;
  absl::Status AnotherWrites(absl::string_view how) const;
  void Write();
  void Take(const v1::StreamMeasurementsResponse& response);
  bool Wait(std::chrono::milliseconds delay) const;
  void Tell(const std::string& sentence);

  Client& client_;
  const std::string session_;
  const std::string writer_;  // random id by which the daemon recognizes this stream's connections
  const MeasurementStreamOptions options_;
  const MeasurementStreamCallbacks callbacks_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::unique_ptr<Connection> connection_;
  // Batches that are not acknowledged, in order. The first `written_` of them were handed to the
  // present connection.
  std::deque<std::shared_ptr<const v1::StreamMeasurementsRequest>> pending_;
  size_t written_ = 0;
  int64_t last_sequence_ = 0;  // of the last batch handed over
  int attempts_ = 0;           // to reach the daemon, since the last acknowledgement or refusal
  int refusals_ = 0;           // for lack of room, since the last acknowledgement
  bool told_of_refusal_ = false;
  std::string told_;  // the sentence reported last
  bool finishing_ = false;
  std::optional<v1::Estimate> last_estimate_;
};

}  // namespace polyest
