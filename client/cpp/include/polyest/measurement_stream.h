#pragma once

// Sends batches of measurements to a session and receives estimates, over a connection that may
// break.
//
// A batch is kept until the daemon has acknowledged it. When the connection breaks, the next Send
// or Finish connects again, asks for the last batch that the session has, and sends the batches
// after it. So no batch is lost and none is counted twice. The stream also connects again when the
// daemon has no room now but may have later (its disk is full, it is busy), and when the token was
// replaced. Open, too, tries again while the daemon cannot be reached.

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

// Options for sending and for connecting again.
struct MeasurementStreamOptions {
  // Number of batches without acknowledgement at which Send waits, ≥ 1.
  int max_unacknowledged = 16;
  // Policy that says how often the daemon sends estimates; none: after every batch.
  std::optional<v1::StreamMeasurementsRequest::EstimatePolicy> estimates;
  // Delay before the first attempt to connect again. It doubles from one attempt to the next.
  std::chrono::milliseconds first_delay{100};
  // Longest delay between attempts, unless the daemon asks for a longer one.
  std::chrono::milliseconds max_delay{5'000};
  // Number of attempts to reach the daemon, ≥ 0, without an acknowledgement in between, after which
  // the stream fails. While the daemon responds and asks to try later, attempts are not limited.
  int max_attempts = 16;
  // Waits for a delay. If it returns false, the stream gives up and fails. Null: the thread sleeps.
  std::function<bool(std::chrono::milliseconds)> wait = nullptr;
};

// Callbacks of a stream, all optional. They are called from a thread of gRPC, one at a time, except
// `connection`, which is called from within Open, Send and Finish.
struct MeasurementStreamCallbacks {
  // Receives a new estimate, as often as MeasurementStreamOptions::estimates says.
  std::function<void(const v1::Estimate&)> estimate;
  // Receives the sequence number up to which the daemon has stored the batches.
  std::function<void(const v1::Acknowledgement&)> acknowledgement;
  // Receives one sentence when the connection fails or is restored, and when the daemon has no room
  // for batches or has room again.
  std::function<void(const std::string&)> connection;
};

// A stream of measurements, for use by one thread. After a function has failed, the stream cannot
// be used any more.
class MeasurementStream {
 public:
  // `session` is the name of an existing session, `sessions/{id}`. `client` must outlive the
  // stream.
  MeasurementStream(Client& client, std::string session, MeasurementStreamOptions options,
                    MeasurementStreamCallbacks callbacks);
  // Cancels the connection and drops the batches that are not acknowledged.
  ~MeasurementStream();
  MeasurementStream(const MeasurementStream&) = delete;
  MeasurementStream& operator=(const MeasurementStream&) = delete;

  // Connects. Must be called once, before any other function. The numbers of batches continue from
  // the session's last. NOT_FOUND if there is no such session; UNAVAILABLE if there is no
  // connection after all attempts.
  absl::Status Open();
  // Hands over one batch. Waits while too many batches are not acknowledged. DATA_LOSS if the
  // daemon has lost the session; UNAVAILABLE if there is no connection after all attempts.
  absl::Status Send(v1::Measurements batch);
  // Ends the batches, waits for all acknowledgements and returns the last estimate; none if the
  // session has no samples. Fails like Send.
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
  bool finishing_ = false;
  std::optional<v1::Estimate> last_estimate_;
};

}  // namespace polyest
