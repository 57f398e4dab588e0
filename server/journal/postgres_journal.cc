#include "server/journal/postgres_journal.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <utility>

#include "core/common/status.h"
#include "server/digest/digest.h"
#include "server/journal/postgres_rows.h"
#include "server/journal/postgres_schema.h"
#include "server/journal/session_digest.h"

namespace polyest::internal {
namespace {

constexpr char kNextNumber[] = "SELECT nextval('session_number')";
// Writes as much as a batch may well have, because a full disk still takes a little.
constexpr char kTryWriting[] =
    "INSERT INTO batch SELECT -1, $1, decode(repeat('00', 65536), 'hex'), '', 0, 0, 0, 0, 0 ON "
    "CONFLICT DO NOTHING";
constexpr char kUndoTry[] = "DELETE FROM batch WHERE session = -1 AND sequence = $1";
constexpr char kDigestOfBatch[] = "SELECT digest FROM batch WHERE session = $1 AND sequence = $2";
constexpr char kSnapshot[] = "SELECT sequence, rows, state FROM snapshot WHERE session = $1";
constexpr char kHistory[] =
    "SELECT ordinal, sequence, point FROM history WHERE session = $1 ORDER BY ordinal";

}  // namespace

absl::StatusOr<std::unique_ptr<PostgresJournal>> PostgresJournal::Open(
    const PostgresJournalOptions& options) {
  POLYEST_ASSIGN_OR_RETURN(const PostgresTarget target, PostgresTarget::Parse(options.uri));
  auto pool = std::make_unique<PostgresPool>(target);
  {
    POLYEST_ASSIGN_OR_RETURN(PostgresPool::Loan connection, pool->Borrow());
    POLYEST_RETURN_IF_ERROR(PreparePostgresSchema(*connection));
  }
  POLYEST_ASSIGN_OR_RETURN(auto node, PostgresNode::Join(*pool, target, options.node));
  return std::unique_ptr<PostgresJournal>(
      new PostgresJournal(std::move(pool), std::move(node), target, options.on_commit));
}

PostgresJournal::PostgresJournal(std::unique_ptr<PostgresPool> pool,
                                 std::unique_ptr<PostgresNode> node, const PostgresTarget& target,
                                 OnCommit on_commit)
    : pool_(std::move(pool)),
      node_(std::move(node)),
      queue_(std::make_unique<CommitQueue<PostgresWriter>>(std::make_unique<PostgresWriter>(target),
                                                           std::move(on_commit))) {}

// The queue ends first, so that the sessions are still this node's while it writes the rest.
PostgresJournal::~PostgresJournal() = default;

std::pair<PostgresOwner, std::string> PostgresJournal::HoldOf(int64_t session) const {
  const PostgresNode::Hold hold = node_->HoldOf(session);
  // No tenant has the lane without a name, in which sessions are created and deleted.
  return {{node_->number(), hold.epoch}, hold.epoch == 0 ? "" : "tenant " + hold.tenant};
}

void PostgresJournal::Release(int64_t session) {
  // The points of its history that nobody waits for still carry the epoch.
  queue_->Flush();
  node_->Release(session);
}

absl::Status PostgresJournal::CheckWritable() {
  const int64_t node = node_->number();
  return queue_->Run([node](PostgresWriter& writer) {
    writer.Send(kTryWriting, PostgresParameters().Add(node));
    writer.Send(kUndoTry, PostgresParameters().Add(node));
    return absl::OkStatus();
  });
}

absl::StatusOr<std::unique_ptr<JournalBackup>> PostgresJournal::BackUp(const Stop&) {
  return absl::FailedPreconditionError(
      "the sessions are in a PostgreSQL database (--journal): back it up with PostgreSQL's own "
      "pg_basebackup, or pg_dump");
}

absl::StatusOr<std::optional<SessionHead>> PostgresJournal::HeadOf(const std::string& tenant,
                                                                   const std::string& name) const {
  POLYEST_ASSIGN_OR_RETURN(std::optional<SessionHead> head, FindHead(*pool_, tenant, name));
  if (!head) return head;
  const absl::Status owner = node_->CheckOwner(head->number);
  if (absl::IsNotFound(owner)) return std::nullopt;
  POLYEST_RETURN_IF_ERROR(owner);
  return head;
}

absl::StatusOr<std::vector<SessionHead>> PostgresJournal::Heads() const {
  return ReadHeads(*pool_);
}

absl::StatusOr<std::vector<SessionHead>> PostgresJournal::HeadsAfter(const std::string& tenant,
                                                                     const std::string& after,
                                                                     int64_t count) const {
  return ReadHeadsAfter(*pool_, tenant, after, count);
}

absl::StatusOr<int64_t> PostgresJournal::Create(const SessionHead& head, const v1::Problem& problem,
                                                bool hidden) {
  POLYEST_RETURN_IF_ERROR(node_->CheckTakes());
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult next, pool_->Query(kNextNumber));
  SessionHead created = head;
  created.number = next.Integer(0, 0);
  const std::string bytes = DeterministicBytes(problem);
  const std::string digest = SessionDigest(created, hidden, bytes);
  POLYEST_RETURN_IF_ERROR(queue_->Run([&](PostgresWriter& writer) {
    SendSession(writer, created, hidden, bytes, digest, node_->number());
    return absl::OkStatus();
  }));
  node_->OnCreated(created.number, created.tenant);
  return created.number;
}

absl::Status PostgresJournal::Show(int64_t session) {
  POLYEST_ASSIGN_OR_RETURN(const SessionRow row, ReadRow(*pool_, session));
  const std::string digest = SessionDigest(row.head, /*hidden=*/false, row.problem);
  const PostgresOwner owner = HoldOf(session).first;
  return queue_->Run([&](PostgresWriter& writer) {
    SendShow(writer, session, digest, owner);
    return absl::OkStatus();
  });
}

absl::Status PostgresJournal::Delete(int64_t session) {
  if (!node_->Owns(session)) POLYEST_RETURN_IF_ERROR(node_->Claim(session).status());
  const auto [owner, lane] = HoldOf(session);
  POLYEST_RETURN_IF_ERROR(queue_->Run(
      [session, owner = owner](PostgresWriter& writer) {
        SendDelete(writer, session, owner);
        return absl::OkStatus();
      },
      lane));
  node_->OnDeleted(session);
  node_->RemoveDeleted();
  return absl::OkStatus();
}

void PostgresJournal::Append(JournalEntry entry, Done done) {
  const auto [owner, lane] = HoldOf(entry.session);
  const auto send_with = [owner = owner](auto send) {
    return [=](PostgresWriter& writer, const JournalEntry& batch, const BatchPart& part) {
      send(writer, batch, part, owner);
      return absl::OkStatus();
    };
  };
  const auto remove = [owner = owner](PostgresWriter& writer, const JournalEntry& batch) {
    SendRemovalOfParts(writer, batch, owner);
    return absl::OkStatus();
  };
  const auto send_last = [](PostgresWriter& writer, const JournalEntry& batch,
                            const BatchPart& last, const PostgresOwner& of) {
    writer.SendBatch({.entry = &batch, .last = last, .owner = of});
  };
  SubmitInParts(*queue_, std::move(entry), lane, send_with(SendPart), send_with(send_last), remove,
                std::move(done));
}

void PostgresJournal::SaveSnapshot(int64_t session, JournalSnapshot snapshot) {
  const auto [owner, lane] = HoldOf(session);
  const auto bytes = static_cast<int64_t>(snapshot.state.size());
  queue_->Submit(
      [session, owner = owner, snapshot = std::move(snapshot)](PostgresWriter& writer) {
        SendSnapshot(writer, session, snapshot, owner);
        return absl::OkStatus();
      },
      [](const absl::Status&) {}, lane, bytes);
}

void PostgresJournal::SaveHistoryPoint(int64_t session, JournalHistoryPoint point, int64_t stride) {
  const auto [owner, lane] = HoldOf(session);
  queue_->SubmitLazily(
      [session, owner = owner, point = std::move(point), stride](PostgresWriter& writer) {
        SendHistoryPoint(writer, session, point, stride, owner);
        return absl::OkStatus();
      },
      lane);
}

absl::StatusOr<v1::Problem> PostgresJournal::ReadProblem(int64_t session) const {
  POLYEST_ASSIGN_OR_RETURN(const SessionRow row, ReadRow(*pool_, session));
  return ProblemIn(row);
}

absl::Status PostgresJournal::ReadBatches(
    int64_t session, int64_t after,
    const std::function<absl::Status(const JournalBatch&)>& take) const {
  JournalBatch batch;
  batch.sequence = after;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const PostgresResult page, ReadPage(*pool_, session, batch.sequence));
    for (int row = 0; row < page.rows(); ++row) {
      if (page.Integer(row, 0) == 0) return absl::OkStatus();  // no batch is left
      const std::string bytes = page.Bytes(row, 1);
      ++batch.sequence;
      if (page.Integer(row, 0) != batch.sequence || page.Bytes(row, 2) != Digest(bytes) ||
          !batch.measurements.ParseFromString(bytes)) {
        return absl::DataLossError(absl::StrFormat(
            "batch %d of the session is damaged or missing in the journal", batch.sequence));
      }
      POLYEST_RETURN_IF_ERROR(take(batch));
    }
  }
}

absl::StatusOr<std::string> PostgresJournal::ReadDigest(int64_t session, int64_t sequence) const {
  POLYEST_ASSIGN_OR_RETURN(
      const PostgresResult result,
      pool_->Query(kDigestOfBatch, PostgresParameters().Add(session).Add(sequence)));
  if (result.rows() == 0) return absl::NotFoundError("the journal has no such batch");
  return result.Bytes(0, 0);
}

absl::StatusOr<std::optional<JournalSnapshot>> PostgresJournal::ReadSnapshot(
    int64_t session) const {
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult result,
                           pool_->Query(kSnapshot, PostgresParameters().Add(session)));
  if (result.rows() == 0) return std::nullopt;
  return JournalSnapshot{result.Integer(0, 0), result.Integer(0, 1), result.Bytes(0, 2)};
}

absl::StatusOr<std::vector<JournalHistoryPoint>> PostgresJournal::ReadHistory(
    int64_t session) const {
  queue_->Flush();
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult result,
                           pool_->Query(kHistory, PostgresParameters().Add(session)));
  std::vector<JournalHistoryPoint> history;
  for (int row = 0; row < result.rows(); ++row) {
    history.push_back({result.Integer(row, 0), result.Integer(row, 1), result.Bytes(row, 2)});
  }
  return history;
}

}  // namespace polyest::internal
