#include "server/sessions/loaded_session.h"

#include <absl/strings/str_cat.h>

#include <limits>
#include <optional>
#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/estimator/estimator_access.h"
#include "core/estimator/memory_use.h"
#include "core/propagation/trajectory_ensemble.h"
#include "proto/wire/convert/estimate.h"

namespace polyest::internal {
namespace {

// A problem is held as it came, as the core's structs, and by the estimator's parts.
constexpr int64_t kCopiesOfProblem = 4;

constexpr int64_t kAllBatches = std::numeric_limits<int64_t>::max();

// Returns the number of threads of a session's estimator. A model that runs in processes of its own
// would keep as many of them as long as the session is loaded.
int ThreadsFor(const ResolvedProblem& problem, int threads) {
  const Model* const model = problem.problem().model.get();
  return dynamic_cast<const SelfPropagatingModel*>(model) != nullptr ? 1 : threads;
}

}  // namespace

absl::StatusOr<std::unique_ptr<LoadedSession>> LoadedSession::Make(v1::Problem problem,
                                                                   double reorder_window_s,
                                                                   const Options& options,
                                                                   const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem resolved,
                           ToProblem(problem, options.models, options.limits));
  if (options.check_memory) {
    POLYEST_RETURN_IF_ERROR(options.check_memory(ExpectedBytes(resolved)));
  }
  std::unique_ptr<LoadedSession> loaded(
      new LoadedSession(std::move(problem), resolved, reorder_window_s, options.threads));
  POLYEST_ASSIGN_OR_RETURN(loaded->computed_, loaded->Begin({}, stop));
  return loaded;
}

LoadedSession::LoadedSession(v1::Problem problem, const ResolvedProblem& resolved,
                             double reorder_window_s, int threads)
    : problem_(std::move(problem)),
      reorder_window_s_(reorder_window_s),
      threads_(threads),
      intake_(resolved, reorder_window_s) {}

absl::StatusOr<LoadedSession::Computed> LoadedSession::Begin(RunCuts cuts, const Stop& stop) {
  Computed computed;
  computed.store = std::make_shared<JournalStore>(intake_.problem(), reorder_window_s_, cuts);
  computed.cuts = std::move(cuts);
  if (journal_ != nullptr) computed.store->ReadFrom(*journal_, number_);
  EstimatorOptions options;
  options.threads = ThreadsFor(intake_.problem(), threads_);
  options.store = computed.store;
  options.snapshot = [this](EstimatorSnapshot snapshot) {
    if (save_) save_(std::move(snapshot));
  };
  POLYEST_ASSIGN_OR_RETURN(computed.estimator,
                           EstimatorAccess::Make(intake_.problem(), std::move(options), stop));
  return computed;
}

void LoadedSession::ReadFrom(const SessionJournal& journal, int64_t session) {
  journal_ = &journal;
  number_ = session;
  computed_.store->ReadFrom(journal, session);
}

void LoadedSession::Attach(SessionJournal& journal, int64_t session,
                           TakeSnapshotStorage take_storage) {
  ReadFrom(journal, session);
  save_ = [this, &journal, take_storage = std::move(take_storage)](EstimatorSnapshot snapshot) {
    std::string state = computed_.cuts.Prepend(std::move(snapshot.state));
    if (!take_storage(static_cast<int64_t>(state.size()))) return;
    journal.SaveSnapshot(number_, {computed_.sequence, snapshot.rows, std::move(state)});
  };
}

std::pair<RunCuts, EstimatorSnapshot> LoadedSession::Snapshot() const {
  auto saved = journal_->ReadSnapshot(number_);
  if (!saved.ok() || !saved->has_value()) return {};
  EstimatorSnapshot snapshot{(*saved)->rows, std::move((*saved)->state)};
  absl::StatusOr<RunCuts> cuts = RunCuts::Split(snapshot.state);
  if (!cuts.ok()) return {};
  return {*std::move(cuts), std::move(snapshot)};
}

absl::StatusOr<std::unique_ptr<LoadedSession>> LoadedSession::Load(const SessionJournal& journal,
                                                                   const SessionHead& head,
                                                                   const SessionPlace& place,
                                                                   const Options& options,
                                                                   const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(v1::Problem problem, journal.ReadProblem(head.number));
  POLYEST_ASSIGN_OR_RETURN(auto loaded,
                           Make(std::move(problem), head.reorder_window_s, options, stop));
  loaded->ReadFrom(journal, head.number);
  auto [cuts, snapshot] = loaded->Snapshot();
  const bool any_cut = !cuts.empty();
  if (any_cut) {
    POLYEST_ASSIGN_OR_RETURN(loaded->computed_, loaded->Begin(std::move(cuts), stop));
  }
  POLYEST_RETURN_IF_ERROR(loaded->Replay(kAllBatches, loaded->intake_, loaded->computed_, stop));
  const SessionPlace reached = loaded->intake_.place();
  if (reached.sequence != place.sequence || reached.rows != place.rows) {
    return absl::DataLossError("the last batches of the session are missing in the journal");
  }
  // A snapshot only saves time, so one that cannot be used is ignored, and so are its cuts, which
  // may be those of another version.
  const bool restored =
      !snapshot.state.empty() && loaded->computed_.estimator->Restore(snapshot, stop).ok();
  POLYEST_RETURN_IF_ERROR(stop.Check());
  if (any_cut && !restored) POLYEST_RETURN_IF_ERROR(loaded->BeginAnew({}, {}, stop));
  return loaded;
}

absl::Status LoadedSession::BeginAnew(RunCuts cuts, const EstimatorSnapshot& snapshot,
                                      const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(Computed anew, Begin(std::move(cuts), stop));
  BatchIntake intake(intake_.problem(), reorder_window_s_);
  POLYEST_RETURN_IF_ERROR(Replay(computed_.sequence, intake, anew, stop));
  if (anew.sequence != computed_.sequence) {
    return absl::DataLossError("the last batches of the session are missing in the journal");
  }
  // The snapshot only saves time.
  if (!snapshot.state.empty()) anew.estimator->Restore(snapshot, stop).IgnoreError();
  POLYEST_RETURN_IF_ERROR(stop.Check());
  computed_ = std::move(anew);
  in_doubt_ = false;
  latest_ = nullptr;
  return absl::OkStatus();
}

absl::Status LoadedSession::Replay(int64_t last, BatchIntake& intake, Computed& computed,
                                   const Stop& stop) const {
  const auto give = [&](const JournalBatch& batch) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    POLYEST_RETURN_IF_ERROR(intake.Take(batch.measurements));
    POLYEST_RETURN_IF_ERROR(Give(*intake.Oldest(batch.sequence), computed));
    intake.RemoveOldest();
    computed.store->Release(batch.sequence);
    return absl::OkStatus();
  };
  return journal_->ReadBatchesUpTo(number_, 0, last, give);
}

int64_t LoadedSession::RowBytes(const ResolvedProblem& problem) {
  const auto columns =
      std::ssize(problem.problem().measured) + std::ssize(problem.streamed_inputs());
  // Each column has a value and a standard deviation.
  return static_cast<int64_t>(sizeof(SampleRow) + 2 * sizeof(double) * columns);
}

int64_t LoadedSession::memory_bytes() const {
  return EstimatorAccess::MemoryBytes(*computed_.estimator) +
         rows_in_memory() * RowBytes(intake_.problem()) + intake_.held_bytes() +
         kCopiesOfProblem * static_cast<int64_t>(problem_.ByteSizeLong());
}

absl::Status LoadedSession::Store(int64_t sequence) {
  POLYEST_RETURN_IF_ERROR(GiveUpTo(sequence));
  Release(sequence);
  return absl::OkStatus();
}

template <typename Function>
std::invoke_result_t<Function> LoadedSession::AllOrDoubt(const Function& work) {
  in_doubt_ = true;
  std::invoke_result_t<Function> result = work();
  in_doubt_ = false;
  return result;
}

absl::Status LoadedSession::Renew(const Stop& stop) {
  return BeginAnew(computed_.cuts, Snapshot().second, stop);
}

absl::Status LoadedSession::ProcessUpTo(int64_t sequence, const Stop& stop) {
  return AllOrDoubt([&]() -> absl::Status {
    POLYEST_RETURN_IF_ERROR(GiveUpTo(sequence));
    return computed_.estimator->Process(stop);
  });
}

// If the numerics fail twice after the same number of rows, the cause is not the row that follows
// but what is computed after the one before it.
absl::Status LoadedSession::EndFailedRun(const absl::Status& reason, const Stop& stop) {
  const int64_t processed = computed_.estimator->rows_processed();
  const bool at_next = processed < computed_.store->rows() && processed != failed_rows_;
  const int64_t failed = at_next ? processed : processed - 1;
  if (failed < 0) return reason;
  RowBlock block;
  POLYEST_RETURN_IF_ERROR(computed_.store->Read(failed, 1, block));
  RunCuts cuts = computed_.cuts;
  cuts.Add(block.rows.front(), failed == 0, reason.message());
  // The snapshot is of rows before the failure.
  POLYEST_RETURN_IF_ERROR(BeginAnew(std::move(cuts), Snapshot().second, stop));
  failed_rows_ = processed;
  return absl::OkStatus();
}

absl::Status LoadedSession::WithEstimator(const Work& work) {
  return AllOrDoubt([&]() -> absl::Status {
    POLYEST_RETURN_IF_ERROR(GiveUpTo(kAllBatches));
    return work(*computed_.estimator, computed_.sequence);
  });
}

absl::Status LoadedSession::GiveUpTo(int64_t sequence) {
  while (const TakenBatch* const batch = intake_.Oldest(sequence)) {
    POLYEST_RETURN_IF_ERROR(Give(*batch, computed_));
    intake_.RemoveOldest();
  }
  return absl::OkStatus();
}

absl::Status LoadedSession::Give(const TakenBatch& batch, Computed& computed) {
  computed.store->SetHeldFrom(batch.held_from);
  const Samples samples = computed.cuts.Keep(batch.samples);
  if (RowReorder::IsNothing(samples)) {
    computed.store->PassOver();
  } else {
    POLYEST_RETURN_IF_ERROR(computed.estimator->Append(samples));
  }
  computed.sequence = batch.place.sequence;
  computed.measured_s = batch.measured_s;
  return absl::OkStatus();
}

absl::StatusOr<SharedEstimate> LoadedSession::CurrentEstimate(const Stop& stop) {
  if (latest_ != nullptr && latest_->sequence() == computed_.sequence) return latest_;
  absl::StatusOr<Estimate> estimate =
      AllOrDoubt([&] { return computed_.estimator->CurrentEstimate(stop); });
  if (absl::IsFailedPrecondition(estimate.status())) {
    estimate = PriorEstimate(estimate.status(), stop);
  }
  POLYEST_RETURN_IF_ERROR(estimate.status());
  if (!computed_.cuts.empty()) estimate->diagnostics.push_back(computed_.cuts.Describe());
  auto latest = std::make_shared<v1::Estimate>(ToProto(*estimate));
  latest->set_sequence(computed_.sequence);
  latest_ = std::move(latest);
  return latest_;
}

// Returns what is known without any sample, for a posterior that is not found.
absl::StatusOr<Estimate> LoadedSession::PriorEstimate(const absl::Status& reason,
                                                      const Stop& stop) const {
  POLYEST_ASSIGN_OR_RETURN(const auto prior, EstimatorAccess::Make(intake_.problem(), {}, stop));
  POLYEST_ASSIGN_OR_RETURN(Estimate estimate, prior->CurrentEstimate(stop));
  estimate.diagnostics.push_back(
      {DiagnosticCode::kNotConverged,
       absl::StrCat("no posterior was found, and these are the numbers of the prior: ",
                    reason.message())});
  return estimate;
}

}  // namespace polyest::internal
