#include "server/sessions/loaded_session.h"

#include <limits>
#include <optional>
#include <utility>

#include "core/common/status.h"
#include "core/estimator/estimator_access.h"
#include "proto/wire/convert/estimate.h"

namespace polyest::internal {

absl::StatusOr<std::unique_ptr<LoadedSession>> LoadedSession::Make(v1::Problem problem,
                                                                   const ModelLibrary& models,
                                                                   const ProblemLimits& limits,
                                                                   double reorder_window_s) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem resolved, ToProblem(problem, models, limits));
  std::unique_ptr<LoadedSession> loaded(
      new LoadedSession(std::move(problem), resolved, reorder_window_s));
  EstimatorOptions options;
  options.store = loaded->store_;
  options.snapshot = [session = loaded.get()](EstimatorSnapshot snapshot) {
    if (session->save_) session->save_(std::move(snapshot));
  };
  POLYEST_ASSIGN_OR_RETURN(loaded->estimator_,
                           EstimatorAccess::Make(std::move(resolved), std::move(options)));
  return loaded;
}

void LoadedSession::Attach(SessionJournal& journal, int64_t session) {
  store_->ReadFrom(journal, session);
  save_ = [this, &journal, session](EstimatorSnapshot snapshot) {
    journal.SaveSnapshot(session, {sequence_, snapshot.rows, std::move(snapshot.state)});
  };
}

// Restores the estimator from the journal's snapshot, if there is a usable one. A snapshot only
// saves time, so all errors are ignored.
void LoadedSession::Restore(const SessionJournal& journal, int64_t session) {
  auto snapshot = journal.ReadSnapshot(session);
  if (!snapshot.ok() || !snapshot->has_value()) return;
  estimator_->Restore({(*snapshot)->rows, std::move((*snapshot)->state)}).IgnoreError();
}

absl::StatusOr<std::unique_ptr<LoadedSession>> LoadedSession::Load(const SessionJournal& journal,
                                                                   const SessionHead& head,
                                                                   const SessionPlace& place,
                                                                   const ModelLibrary& models,
                                                                   const Stop& stop) {
  const int64_t session = head.number;
  POLYEST_ASSIGN_OR_RETURN(v1::Problem problem, journal.ReadProblem(session));
  POLYEST_ASSIGN_OR_RETURN(auto loaded,
                           Make(std::move(problem), models, {}, head.reorder_window_s));
  loaded->store_->ReadFrom(journal, session);
  const auto append = [&](const JournalBatch& batch) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    POLYEST_RETURN_IF_ERROR(loaded->intake_.Take(batch.measurements));
    POLYEST_RETURN_IF_ERROR(loaded->GiveUpTo(batch.sequence));
    loaded->Release(batch.sequence);
    return absl::OkStatus();
  };
  POLYEST_RETURN_IF_ERROR(journal.ReadBatches(session, 0, append));
  const SessionPlace reached = loaded->intake_.place();
  if (reached.sequence != place.sequence || reached.rows != place.rows) {
    return absl::DataLossError("the last batches of the session are missing in the journal");
  }
  loaded->Restore(journal, session);
  return loaded;
}

LoadedSession::LoadedSession(v1::Problem problem, const ResolvedProblem& resolved,
                             double reorder_window_s)
    : problem_(std::move(problem)),
      intake_(resolved, reorder_window_s),
      store_(std::make_shared<JournalStore>(intake_.problem(), reorder_window_s)) {}

absl::Status LoadedSession::ProcessUpTo(int64_t sequence, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(GiveUpTo(sequence));
  return estimator_->Process(stop);
}

absl::Status LoadedSession::WithEstimator(const Work& work) {
  POLYEST_RETURN_IF_ERROR(GiveUpTo(std::numeric_limits<int64_t>::max()));
  return work(*estimator_, sequence_);
}

absl::Status LoadedSession::GiveUpTo(int64_t sequence) {
  while (const std::optional<TakenBatch> batch = intake_.Next(sequence)) {
    store_->SetHeldFrom(batch->held_from);
    if (RowReorder::IsNothing(batch->samples)) {
      store_->PassOver();
    } else {
      POLYEST_RETURN_IF_ERROR(estimator_->Append(batch->samples));
    }
    sequence_ = batch->place.sequence;
    measured_s_ = batch->measured_s;
  }
  return absl::OkStatus();
}

absl::StatusOr<SharedEstimate> LoadedSession::CurrentEstimate(const Stop& stop) {
  if (latest_ != nullptr && latest_->sequence() == sequence_) return latest_;
  POLYEST_ASSIGN_OR_RETURN(const Estimate estimate, estimator_->CurrentEstimate(stop));
  auto latest = std::make_shared<v1::Estimate>(ToProto(estimate));
  latest->set_sequence(sequence_);
  latest_ = std::move(latest);
  return latest_;
}

}  // namespace polyest::internal
