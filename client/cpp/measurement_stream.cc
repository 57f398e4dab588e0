#include "polyest/measurement_stream.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <random>
#include <thread>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest {

using namespace internal;

namespace {

std::string RandomId() {
  std::random_device device;
  std::string id;
  for (int i = 0; i < 4; ++i) absl::StrAppendFormat(&id, "%08x", device());
  return id;
}

// Returns whether a new connection may help: the daemon cannot be reached, or it has cancelled its
// calls while shutting down.
bool IsBreak(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsCancelled(status);
}

// Returns the delay that a daemon asks for when it responds but has no room for batches, because
// its disk is full or it is busy; none for any other error.
std::optional<std::chrono::milliseconds> DelayOfRefusal(const absl::Status& status) {
  if (!absl::IsResourceExhausted(status)) return std::nullopt;
  const std::optional<Refusal> refusal = RefusalOf(status);
  return refusal ? refusal->retry_delay : std::nullopt;
}

}  // namespace

// One connection, guarded by the stream's mutex. It does not access its own members after OnDone
// has released the mutex, so the stream may delete it then. A read is always pending until `ended_`
// is set; it keeps the call alive while the stream starts writes from outside a reaction.
class MeasurementStream::Connection
    : public grpc::ClientBidiReactor<v1::StreamMeasurementsRequest,
                                     v1::StreamMeasurementsResponse> {
 public:
  explicit Connection(MeasurementStream& stream) : stream_(stream) {}

  // Starts the call and sends the first message, which names the session, the writer and the policy
  // for estimates.
  void Start() {
    auto hello = std::make_shared<v1::StreamMeasurementsRequest>();
    hello->set_session(stream_.session_);
    hello->set_writer(stream_.writer_);
    if (stream_.options_.estimates) *hello->mutable_estimates() = *stream_.options_.estimates;
    authorization_ = stream_.client_.Authorization();
    if (!authorization_.empty()) context_.AddMetadata("authorization", authorization_);
    stream_.client_.LimitToEnd(context_);
    stream_.client_.sessions().async()->StreamMeasurements(&context_, this);
    StartRead(&response_);
    Write(std::move(hello));
    StartCall();
  }

  bool writable() const { return !writing_ && !ended_ && !half_closed_; }
  bool done() const { return status_.has_value(); }
  const absl::Status& status() const { return *status_; }
  // Returns whether the token has changed since the connection was started.
  bool Outdated() const { return authorization_ != stream_.client_.Authorization(); }

  void Write(std::shared_ptr<const v1::StreamMeasurementsRequest> request) {
    writing_ = std::move(request);
    StartWrite(writing_.get());
  }
  void HalfClose() {
    half_closed_ = true;
    StartWritesDone();
  }
  void Cancel() { context_.TryCancel(); }

  void OnReadDone(bool ok) override {
    if (!ok) {
      const Lock lock(stream_.mutex_);
      ended_ = true;
      return;
    }
    stream_.Take(response_);
    response_.Clear();
    StartRead(&response_);
  }
  void OnWriteDone(bool ok) override {
    const Lock lock(stream_.mutex_);
    writing_ = nullptr;
    if (ok) stream_.Write();
  }
  void OnDone(const grpc::Status& status) override {
    const Lock lock(stream_.mutex_);
    status_ = FromGrpc(status);
    stream_.changed_.notify_all();
  }

 private:
  MeasurementStream& stream_;
  grpc::ClientContext context_;
  std::string authorization_;
  v1::StreamMeasurementsResponse response_;
  std::shared_ptr<const v1::StreamMeasurementsRequest> writing_;  // in use until OnWriteDone
  bool ended_ = false;
  bool half_closed_ = false;
  std::optional<absl::Status> status_;
};

MeasurementStream::MeasurementStream(Client& client, std::string session,
                                     MeasurementStreamOptions options,
                                     MeasurementStreamCallbacks callbacks)
    : client_(client),
      session_(std::move(session)),
      writer_(RandomId()),
      options_(std::move(options)),
      callbacks_(std::move(callbacks)) {
  POLYEST_CHECK(options_.max_unacknowledged >= 1);
  POLYEST_CHECK(options_.max_attempts >= 0);
}

MeasurementStream::~MeasurementStream() {
  Lock lock(mutex_);
  if (!connection_) return;
  connection_->Cancel();
  changed_.wait(lock, [this] { return connection_->done(); });
}

bool MeasurementStream::Wait(std::chrono::milliseconds delay) const {
  if (options_.wait) return options_.wait(delay);
  std::this_thread::sleep_for(delay);
  return true;
}

// Reports that the daemon accepts batches again, once one is acknowledged after a refusal. The lock
// is held on entry and exit.
void MeasurementStream::TellOfRoom(Lock& lock) {
  if (refusals_ > 0 || !std::exchange(told_of_refusal_, false)) return;
  lock.unlock();
  Tell("the daemon accepts batches again");
  lock.lock();
}

// Reports a sentence unless it is the one reported last, as while a disk stays full.
void MeasurementStream::Tell(const std::string& sentence) {
  if (sentence == told_ || !callbacks_.connection) return;
  told_ = sentence;
  callbacks_.connection(sentence);
}

// Writes the next batch, or half-closes the connection after the last one, if no write is pending.
// The caller holds the lock.
void MeasurementStream::Write() {
  if (!connection_ || !connection_->writable()) return;
  if (written_ < pending_.size()) {
    connection_->Write(pending_[written_++]);
  } else if (finishing_) {
    connection_->HalfClose();
  }
}

void MeasurementStream::Take(const v1::StreamMeasurementsResponse& response) {
  if (response.has_acknowledgement()) {
    {
      const Lock lock(mutex_);
      while (!pending_.empty() &&
             pending_.front()->sequence() <= response.acknowledgement().sequence()) {
        pending_.pop_front();
        written_ -= std::min<size_t>(written_, 1);
      }
      attempts_ = 0;
      refusals_ = 0;
      changed_.notify_all();
    }
    if (callbacks_.acknowledgement) callbacks_.acknowledgement(response.acknowledgement());
  } else if (response.has_estimate()) {
    {
      const Lock lock(mutex_);
      last_estimate_ = response.estimate();
    }
    if (callbacks_.estimate) callbacks_.estimate(response.estimate());
  }
}

// Checks that a session whose last batch is number `sequence` can be this stream's own, before a
// new connection sends again what has no acknowledgement. The daemon then tells whether the batches
// of these numbers are the stream's. The caller holds the lock.
absl::Status MeasurementStream::CheckIsOwn(int64_t sequence) const {
  const int64_t acknowledged = last_sequence_ - static_cast<int64_t>(pending_.size());
  if (sequence > last_sequence_) {
    return AnotherWrites(
        absl::StrCat("it has batch ", sequence, ", the last one sent is ", last_sequence_));
  }
  if (sequence < acknowledged) {
    return absl::DataLossError(absl::StrCat(session_, " has batches up to ", sequence,
                                            ", but acknowledged them up to ", acknowledged));
  }
  return absl::OkStatus();
}

absl::Status MeasurementStream::AnotherWrites(absl::string_view how) const {
  return absl::AbortedError(absl::StrCat("another client writes to ", session_, ": ", how));
}

absl::Status MeasurementStream::Connect() {
  v1::GetSessionRequest request;
  request.set_name(session_);
  request.set_omit_problem(true);
  POLYEST_ASSIGN_OR_RETURN(const v1::Session session, client_.GetSession(request));
  const Lock lock(mutex_);
  if (!connection_) {
    last_sequence_ = session.last_sequence();
  } else {
    POLYEST_RETURN_IF_ERROR(CheckIsOwn(session.last_sequence()));
    written_ = 0;
  }
  connection_ = std::make_unique<Connection>(*this);
  connection_->Start();
  return absl::OkStatus();
}

absl::Status MeasurementStream::Open() {
  POLYEST_CHECK(!connection_);
  const absl::Status status = Connect();
  if (status.ok()) return status;
  Lock lock(mutex_);
  return ConnectAgain(lock, status);
}

// Returns whether another attempt to connect may help after `status`. The caller holds the lock.
bool MeasurementStream::MayRecover(const absl::Status& status) const {
  if (IsBreak(status)) return attempts_ < options_.max_attempts;
  // The token was replaced; the daemon may accept the new one a moment later.
  if (absl::IsUnauthenticated(status)) {
    return attempts_ < options_.max_attempts && connection_ && connection_->Outdated();
  }
  return DelayOfRefusal(status).has_value();
}

// Counts an attempt or a refusal after `status`, for which MayRecover is true, and returns in words
// what has happened. The caller holds the lock.
std::string MeasurementStream::CountAttempt(const absl::Status& status) {
  if (DelayOfRefusal(status)) {
    ++refusals_;
    attempts_ = 0;
    told_of_refusal_ = true;
    return "the daemon cannot accept batches now";
  }
  ++attempts_;
  if (absl::IsUnauthenticated(status))
    return "the token is no longer valid; a new one is available";
  return connection_ ? "connection lost" : "no connection";
}

// Connects again after `status`, for as long as MayRecover is true, and returns the last status.
// The connection is done or does not exist yet. The lock is held on entry and exit.
absl::Status MeasurementStream::ConnectAgain(Lock& lock, absl::Status status) {
  while (MayRecover(status)) {
    const int before = std::min(attempts_ + refusals_, 20);
    const auto delay = std::max(std::min(options_.max_delay, options_.first_delay * (1 << before)),
                                DelayOfRefusal(status).value_or(std::chrono::milliseconds(0)));
    const std::string what = CountAttempt(status);
    const char* const back = connection_ ? "connected again" : "connected";
    lock.unlock();
    Tell(absl::StrFormat("%s (%s); trying again in %g s", what, status.message(),
                         static_cast<double>(delay.count()) / 1000));
    const bool lost = !DelayOfRefusal(status);
    const bool waited = Wait(delay);
    if (waited) status = Connect();
    if (waited && status.ok() && lost) Tell(back);
    lock.lock();
    if (!waited) return status;
  }
  return status;
}

// Connects again after the connection is done, or returns the reason why that is not possible. The
// lock is held on entry and exit.
absl::Status MeasurementStream::Recover(Lock& lock) {
  const absl::Status lost = connection_->status();
  if (lost.ok())
    return absl::InternalError("the daemon closed the stream before all batches were sent");
  const absl::Status status = ConnectAgain(lock, lost);
  if (absl::IsAlreadyExists(status)) return AnotherWrites(status.message());
  if (absl::IsNotFound(status)) {
    return absl::DataLossError(absl::StrCat(
        "the daemon has lost ", session_, " and the batches it had acknowledged, up to number ",
        last_sequence_ - static_cast<int64_t>(pending_.size()),
        " (it was restarted without a data directory, or the session was deleted)"));
  }
  return status;
}

absl::Status MeasurementStream::Send(v1::Measurements batch) {
  auto request = std::make_shared<v1::StreamMeasurementsRequest>();
  request->set_session(session_);
  *request->mutable_measurements() = std::move(batch);

  Lock lock(mutex_);
  POLYEST_CHECK(connection_ && !finishing_);
  const size_t max = static_cast<size_t>(options_.max_unacknowledged);
  while (connection_->done() || pending_.size() >= max) {
    if (connection_->done()) {
      POLYEST_RETURN_IF_ERROR(Recover(lock));
    } else {
      changed_.wait(lock);
    }
  }
  TellOfRoom(lock);
  request->set_sequence(++last_sequence_);
  pending_.push_back(std::move(request));
  Write();
  return absl::OkStatus();
}

absl::StatusOr<std::optional<v1::Estimate>> MeasurementStream::Finish() {
  Lock lock(mutex_);
  POLYEST_CHECK(connection_ && !finishing_);
  finishing_ = true;
  Write();
  while (true) {
    changed_.wait(lock, [this] { return connection_->done(); });
    if (connection_->status().ok()) break;
    POLYEST_RETURN_IF_ERROR(Recover(lock));
  }
  TellOfRoom(lock);
  if (!pending_.empty()) {
    return absl::InternalError(absl::StrCat("the daemon ended the stream with ", pending_.size(),
                                            " batches not acknowledged"));
  }
  return last_estimate_;
}

std::vector<v1::Measurements> MeasurementStream::Unacknowledged() {
  const Lock lock(mutex_);
  std::vector<v1::Measurements> batches;
  for (const auto& request : pending_) batches.push_back(request->measurements());
  return batches;
}

}  // namespace polyest
