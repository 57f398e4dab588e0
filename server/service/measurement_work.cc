// Does the work of a stream (measurement_stream.h) that may wait: finds and loads its session,
// takes batches and computes them.

#include <absl/strings/str_format.h>

#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "server/execution/guarded.h"
#include "server/service/measurement_stream.h"

namespace polyest::internal {

// Looks for the session where a thread may wait for that.
void MeasurementFlow::Find(const std::string& tenant, const std::string& session,
                           const std::string& writer) {
  auto found = Guarded([&] { return context_.sessions.Find(tenant, session); });
  std::lock_guard lock(mutex_);
  stage_ = Stage::kNone;
  if (!end_) {
    if (PassOn(found.status())) return;
    const absl::Status joined = Join(std::move(found), writer);
    if (!joined.ok()) End(joined);
  }
  Advance();
}

void MeasurementFlow::Load() {
  const absl::Status loaded = stop_.Name(Guarded([this] { return session_->Load(stop_.Begin()); }));
  std::lock_guard lock(mutex_);
  stage_ = Stage::kReady;
  if (!loaded.ok()) End(loaded);
  Advance();
}

void MeasurementFlow::Take() {
  std::unique_lock lock(mutex_);
  TakeSome(lock, [](const v1::StreamMeasurementsRequest&) { return true; });
}

void MeasurementFlow::TakeSome(std::unique_lock<std::mutex>& lock, const Choice& choice) {
  taking_ = true;
  // A turn takes what fits into the inbox, and no more, because other streams wait for their turns.
  for (size_t turn = 0; turn < kInbox && HasBatch() && choice(inbox_.front()); ++turn) {
    TakeOne(lock);
    Advance();
  }
  taking_ = false;
  Advance();
}

void MeasurementFlow::TakeOne(std::unique_lock<std::mutex>& lock) {
  const v1::StreamMeasurementsRequest request = std::move(inbox_.front());
  inbox_.pop_front();
  lock.unlock();
  std::optional<Uncomputed> uncomputed;
  const absl::Status answered = Guarded([&]() -> absl::Status {
    POLYEST_ASSIGN_OR_RETURN(uncomputed, Answer(request));
    return absl::OkStatus();
  });
  lock.lock();
  const auto bytes = static_cast<int64_t>(request.ByteSizeLong());
  if (uncomputed) {
    uncomputed->bytes = bytes;
    uncomputed_.push_back(*uncomputed);
  } else {
    held_->Add(-bytes);
  }
  if (!answered.ok()) End(answered);
}

absl::StatusOr<std::optional<MeasurementFlow::Uncomputed>> MeasurementFlow::Answer(
    const v1::StreamMeasurementsRequest& request) {
  if (request.has_estimates()) POLYEST_RETURN_IF_ERROR(schedule_.Set(request.estimates()));
  if (!request.has_measurements()) {
    if (request.sequence() == 0) return std::nullopt;
    return InvalidField("measurements", absl::StrFormat("batch %d has none", request.sequence()));
  }
  v1::StreamMeasurementsResponse response;
  POLYEST_ASSIGN_OR_RETURN(*response.mutable_acknowledgement(),
                           session_->Add(request.sequence(), request.measurements(), losses_));
  Send(std::move(response), request.sequence());
  return Uncomputed{.sequence = request.sequence(),
                    .estimate = schedule_.Due(EstimateSchedule::Clock::now())};
}

// Returns what is computed in one turn: the batches up to the next estimate, which must not depend
// on later batches of the stream.
std::vector<MeasurementFlow::Uncomputed> MeasurementFlow::NextTurn() {
  std::vector<Uncomputed> turn;
  while (!uncomputed_.empty() && turn.size() < kTurn && (turn.empty() || !turn.back().estimate)) {
    turn.push_back(uncomputed_.front());
    uncomputed_.pop_front();
  }
  return turn;
}

void MeasurementFlow::Compute() {
  std::unique_lock lock(mutex_);
  const std::vector<Uncomputed> turn = NextTurn();
  const bool last = uncomputed_.empty() && AllTaken();
  const absl::Status at_end = half_closed_ ? absl::OkStatus() : drained_.value_or(absl::OkStatus());
  lock.unlock();
  const absl::Status computed = stop_.Name(Guarded([&] { return ComputeTurn(turn, last); }));
  lock.lock();
  if (!computed.ok()) End(computed);
  for (const Uncomputed& one : turn) held_->Add(-one.bytes);
  computing_ = false;
  if (last) End(at_end);
  Advance();
}

absl::Status MeasurementFlow::ComputeTurn(const std::vector<Uncomputed>& turn, bool last) {
  const Stop stop = stop_.Begin();
  if (!turn.empty()) {
    POLYEST_RETURN_IF_ERROR(session_->ProcessUpTo(turn.back().sequence, stop));
    if (turn.back().estimate) POLYEST_RETURN_IF_ERROR(SendEstimate(stop));
  }
  if (!last || session_->taken().samples == 0) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(session_->Process(stop));
  return SendEstimate(stop);
}

absl::Status MeasurementFlow::SendEstimate(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const SharedEstimate estimate, session_->LatestEstimate(stop));
  v1::StreamMeasurementsResponse response;
  *response.mutable_estimate() = *estimate;
  Send(std::move(response), estimate->sequence());
  return absl::OkStatus();
}

void MeasurementFlow::Send(v1::StreamMeasurementsResponse response, int64_t sequence) {
  {
    std::lock_guard lock(mutex_);
    outbox_.push_back({std::move(response), sequence});
  }
  session_->WhenKept(sequence, losses_,
                     [flow = shared_from_this(), sequence](const absl::Status& kept) {
                       flow->OnKept(sequence, kept);
                     });
}

}  // namespace polyest::internal
