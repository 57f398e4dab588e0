#include "server/sessions/session_import.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <future>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "server/digest/digest.h"
#include "server/sessions/create_time.h"
#include "server/sessions/estimate_history.h"
#include "server/sessions/row_limits.h"

namespace polyest::internal {
namespace {

// Estimates at a thousand a second for 30,000 years.
constexpr int64_t kMaxOrdinal = int64_t{1} << 50;
constexpr size_t kMaxPastEstimateBytes = size_t{1} << 16;

}  // namespace

SessionImport::SessionImport(SessionRegistry& registry, std::string tenant) : registry_(registry) {
  head_.tenant = std::move(tenant);
}

SessionImport::~SessionImport() {
  if (loaded_ == nullptr) return;
  registry_.services().journal.Delete(head_.number).IgnoreError();
  registry_.services().stored->Forget(head_.number);
  registry_.services().tenant_memory->Forget(head_.number);
}

absl::Status SessionImport::Take(const v1::ImportSessionRequest& request, const Stop& stop) {
  if (ended_) return InvalidField("record", "must not follow the end");
  switch (request.record().record_case()) {
    case v1::SessionRecord::kHead:
      return Begin(request.session_id(), request.record().head(), stop);
    case v1::SessionRecord::kBatch:
      return Append(request.record().batch());
    case v1::SessionRecord::kPastEstimate:
      return Remember(request.record().past_estimate());
    case v1::SessionRecord::kEnd:
      return TakeEnd();
    case v1::SessionRecord::RECORD_NOT_SET:
      break;
  }
  return InvalidField("record", "must be a head, a batch, a past estimate or the end");
}

absl::Status SessionImport::Begin(const std::string& id, const v1::SessionRecord::Head& head,
                                  const Stop& stop) {
  if (loaded_ != nullptr) {
    return InvalidField("record.head", "there is one already; batches follow it");
  }
  POLYEST_RETURN_IF_ERROR(TakeHead(id, head));
  v1::Problem problem;
  if (!problem.ParseFromString(head.problem())) {
    return InvalidField("record.head.problem", "must be a serialized Problem");
  }
  problem.clear_schema();
  return Store(problem, stop);
}

absl::Status SessionImport::TakeHead(const std::string& id, const v1::SessionRecord::Head& head) {
  head_.name = id.empty() ? head.name() : absl::StrCat("sessions/", id);
  const std::string prefix = "sessions/";
  if (!head_.name.starts_with(prefix)) {
    return InvalidField("record.head.name",
                        absl::StrFormat("\"%s\" must be sessions/{id}", head_.name));
  }
  POLYEST_RETURN_IF_ERROR(CheckSessionId(head_.name.substr(prefix.size())));
  if (head.batch_count() < 0) {
    return InvalidField("record.head.batchCount",
                        absl::StrFormat("%d must not be negative", head.batch_count()));
  }
  POLYEST_RETURN_IF_ERROR(
      CheckReorderWindow({"record", "head", "reorderWindowS"}, head.reorder_window_s()));
  head_.reorder_window_s = head.reorder_window_s();
  POLYEST_RETURN_IF_ERROR(registry_.CheckMayCreate(head_.tenant, head_.name));
  if (!HasJsonForm(head.create_time())) {
    return InvalidField("record.head.createTime",
                        absl::StrFormat("%d s and %d ns must lie in the years 1 to 9999, with 0 to "
                                        "999999999 ns",
                                        head.create_time().seconds(), head.create_time().nanos()));
  }
  head_.create_time = head.create_time();
  promised_ = head.batch_count();
  return absl::OkStatus();
}

absl::Status SessionImport::Store(const v1::Problem& problem, const Stop& stop) {
  const SessionServices& services = registry_.services();
  const auto check_memory = [&](int64_t bytes) {
    return services.tenant_memory->MakeRoom(head_.tenant, bytes);
  };
  POLYEST_ASSIGN_OR_RETURN(
      auto loaded,
      LoadedSession::Make(problem, head_.reorder_window_s,
                          services.Loading(check_memory, services.limits.problem), stop));
  POLYEST_ASSIGN_OR_RETURN(head_.number, services.journal.Create(head_, problem, /*hidden=*/true));
  loaded->Attach(services.journal, head_.number,
                 services.StorageForSnapshots(head_.number, head_.tenant));
  loaded_ = std::move(loaded);
  services.tenant_memory->Set(head_.number, head_.tenant, loaded_->memory_bytes());
  const auto bytes = static_cast<int64_t>(DeterministicBytes(problem).size());
  return services.stored->Take(head_.number, head_.tenant, {0, bytes});
}

absl::Status SessionImport::Append(const v1::SessionRecord::Batch& batch) {
  if (loaded_ == nullptr) {
    return InvalidField("record", "the first must be a session's head");
  }
  const int64_t next = loaded_->intake().place().sequence + 1;
  if (batch.sequence() != next || next > promised_) {
    return InvalidField("record.batch.sequence",
                        absl::StrFormat("%d must be %d, and the head promises %d batches",
                                        batch.sequence(), next, promised_));
  }
  const SessionServices& services = registry_.services();
  POLYEST_RETURN_IF_ERROR(services.memory.Check());
  BatchIntake& intake = loaded_->intake();
  POLYEST_RETURN_IF_ERROR(CheckRows(services.limits, intake.place(), batch.measurements()));
  JournalEntry entry;
  entry.session = head_.number;
  entry.measurements = DeterministicBytes(batch.measurements());
  POLYEST_RETURN_IF_ERROR(services.stored->Take(
      head_.number, head_.tenant,
      {batch.measurements().time_s_size(), static_cast<int64_t>(entry.measurements.size())}));
  POLYEST_RETURN_IF_ERROR(intake.Take(batch.measurements(), services.limits.problem));
  entry.digest = Digest(entry.measurements);
  entry.place = intake.place();
  std::promise<absl::Status> kept;
  services.journal.Append(std::move(entry),
                          [&](const absl::Status& status) { kept.set_value(status); });
  POLYEST_RETURN_IF_ERROR(kept.get_future().get());
  return loaded_->Store(next);
}

absl::Status SessionImport::Remember(const v1::SessionRecord::PastEstimate& past) {
  const int64_t sequence = past.estimate().sequence();
  if (loaded_ == nullptr || loaded_->intake().place().sequence < promised_) {
    return InvalidField("record.pastEstimate", "must follow the head and all batches");
  }
  if (std::ssize(history_) == EstimateHistory::kMaxPoints) {
    return InvalidField("record.pastEstimate",
                        absl::StrFormat("there are more than %d", EstimateHistory::kMaxPoints));
  }
  if (past.ByteSizeLong() > kMaxPastEstimateBytes) {
    return InvalidField("record.pastEstimate",
                        absl::StrFormat("%d bytes are more than there may be, %d",
                                        past.ByteSizeLong(), kMaxPastEstimateBytes));
  }
  const bool first = history_.empty();
  if (past.ordinal() <= (first ? -1 : history_.back().ordinal) || past.ordinal() > kMaxOrdinal) {
    return InvalidField("record.pastEstimate.ordinal",
                        absl::StrFormat("%d must be greater than that before, from 0 to %d",
                                        past.ordinal(), kMaxOrdinal));
  }
  if (sequence <= (first ? -1 : history_.back().sequence) || sequence > promised_) {
    return InvalidField(
        "record.pastEstimate.estimate.sequence",
        absl::StrFormat("%d must be greater than that before and at most %d", sequence, promised_));
  }
  history_.push_back({past.ordinal(), sequence, past.estimate().SerializeAsString()});
  return absl::OkStatus();
}

absl::Status SessionImport::TakeEnd() {
  const int64_t batches = loaded_ == nullptr ? 0 : loaded_->intake().place().sequence;
  if (loaded_ == nullptr || batches < promised_) {
    return InvalidField("record", absl::StrFormat("the session breaks off after batch %d of %d",
                                                  batches, promised_));
  }
  ended_ = true;
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<Session>> SessionImport::Finish() {
  if (!ended_) {
    POLYEST_RETURN_IF_ERROR(TakeEnd());
    return InvalidField("record", "the session breaks off before its end");
  }
  // All ordinals are multiples of the stride with which they were kept, whatever it was.
  for (JournalHistoryPoint& point : history_) {
    registry_.services().journal.SaveHistoryPoint(head_.number, std::move(point), /*stride=*/1);
  }
  const absl::Status shown = registry_.services().journal.Show(head_.number);
  if (absl::IsAlreadyExists(shown)) {
    return absl::AlreadyExistsError(
        absl::StrFormat("there is a session \"%s\" already", head_.name));
  }
  POLYEST_RETURN_IF_ERROR(shown);
  head_.place = loaded_->intake().place();
  return registry_.Adopt(std::move(head_), std::move(loaded_));
}

}  // namespace polyest::internal
