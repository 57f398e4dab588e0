#include "server/journal/postgres_writes.h"

namespace polyest::internal {
namespace {

// Each statement locks the row of the owner until its transaction ends. Who takes the session
// meanwhile waits for that, and a statement that has waited for a taking finds another epoch.
constexpr char kInsertPart[] =
    "WITH held AS MATERIALIZED (SELECT 1 FROM owner WHERE session = $1 AND node = $5 AND epoch = "
    "$6 FOR SHARE), added AS (INSERT INTO part SELECT $1, $2, $3, $4 FROM held "
    "WHERE $2 = 1 + (SELECT coalesce(max(sequence), 0) FROM batch WHERE session = $1) ON CONFLICT "
    "(session, sequence, number) DO UPDATE SET bytes = excluded.bytes RETURNING 1) "
    "SELECT EXISTS (SELECT 1 FROM added), EXISTS (SELECT 1 FROM held), EXISTS (SELECT 1 FROM "
    "session WHERE number = $1)";
constexpr char kRemoveParts[] =
    "WITH held AS MATERIALIZED (SELECT 1 FROM owner WHERE session = $1 AND node = $3 AND epoch = "
    "$4 FOR SHARE) DELETE FROM part USING held WHERE session = $1 AND sequence = $2 AND NOT EXISTS "
    "(SELECT 1 FROM batch WHERE session = $1 AND sequence = $2)";
constexpr char kInsertSession[] =
    "INSERT INTO session VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9) ON CONFLICT DO NOTHING";
constexpr char kInsertOwner[] =
    "INSERT INTO owner SELECT $1, $2, 1 WHERE EXISTS (SELECT 1 FROM session WHERE number = $1)";
constexpr char kShow[] =
    "WITH held AS MATERIALIZED (SELECT 1 FROM owner WHERE session = $1 AND node = $3 AND epoch = "
    "$4 FOR SHARE), shown AS (UPDATE session SET hidden = false, digest = $2 FROM held WHERE "
    "number "
    "= $1 RETURNING 1) SELECT EXISTS (SELECT 1 FROM shown), EXISTS (SELECT 1 FROM held), EXISTS "
    "(SELECT 1 FROM session WHERE number = $1)";
constexpr char kDelete[] =
    "WITH held AS (DELETE FROM owner WHERE session = $1 AND node = $2 AND epoch = $3 RETURNING "
    "session), gone AS (DELETE FROM session USING held WHERE number = held.session RETURNING "
    "number), noted AS (INSERT INTO deleted SELECT number FROM gone RETURNING 1) SELECT EXISTS "
    "(SELECT 1 FROM noted), EXISTS (SELECT 1 FROM held), EXISTS (SELECT 1 FROM session WHERE "
    "number "
    "= $1)";
constexpr char kReplaceSnapshot[] =
    "WITH held AS MATERIALIZED (SELECT 1 FROM owner WHERE session = $1 AND node = $5 AND epoch = "
    "$6 FOR SHARE) INSERT INTO snapshot SELECT $1, $2, $3, $4 FROM held WHERE EXISTS (SELECT 1 "
    "FROM "
    "batch WHERE session = $1 AND sequence = $2) ON CONFLICT (session) DO UPDATE SET sequence = "
    "excluded.sequence, rows = excluded.rows, state = excluded.state";
constexpr char kInsertHistoryPoint[] =
    "WITH held AS MATERIALIZED (SELECT 1 FROM owner WHERE session = $1 AND node = $5 AND epoch = "
    "$6 FOR SHARE) INSERT INTO history SELECT $1, $2, $3, $4 FROM held WHERE EXISTS (SELECT 1 FROM "
    "batch WHERE session = $1 AND sequence = $3) ON CONFLICT (session, ordinal) DO UPDATE SET "
    "sequence = excluded.sequence, point = excluded.point";
constexpr char kThinHistory[] =
    "WITH held AS MATERIALIZED (SELECT 1 FROM owner WHERE session = $1 AND node = $3 AND epoch = "
    "$4 FOR SHARE) DELETE FROM history USING held WHERE session = $1 AND ordinal % $2 <> 0";

}  // namespace

void SendSession(PostgresWriter& writer, const SessionHead& head, bool hidden,
                 std::string_view problem, std::string_view digest, int64_t node) {
  writer.Send(kInsertSession,
              PostgresParameters()
                  .Add(head.number)
                  .AddText(head.tenant)
                  .AddText(head.name)
                  .AddFlag(hidden)
                  .Add(head.create_time.seconds())
                  .Add(int64_t{head.create_time.nanos()})
                  .Add(head.reorder_window_s)
                  .AddBytes(problem)
                  .AddBytes(digest),
              [](const PostgresResult& result) {
                if (result.changes() > 0) return absl::OkStatus();
                return absl::AlreadyExistsError("the journal has a session of that name");
              });
  writer.Send(kInsertOwner, PostgresParameters().Add(head.number).Add(node));
}

void SendShow(PostgresWriter& writer, int64_t session, std::string_view digest,
              const PostgresOwner& owner) {
  writer.Send(kShow,
              PostgresParameters().Add(session).AddBytes(digest).Add(owner.node).Add(owner.epoch),
              JudgeOwned);
}

void SendDelete(PostgresWriter& writer, int64_t session, const PostgresOwner& owner) {
  writer.Send(kDelete, PostgresParameters().Add(session).Add(owner.node).Add(owner.epoch),
              JudgeOwned);
  writer.EndBatches(session, owner);
}

void SendPart(PostgresWriter& writer, const JournalEntry& entry, const BatchPart& part,
              const PostgresOwner& owner) {
  writer.Send(kInsertPart,
              PostgresParameters()
                  .Add(entry.session)
                  .Add(entry.place.sequence)
                  .Add(part.number)
                  .AddBytes(part.bytes)
                  .Add(owner.node)
                  .Add(owner.epoch),
              [sequence = entry.place.sequence](const PostgresResult& result) {
                const absl::Status judged = JudgeOwned(result);
                return absl::IsFailedPrecondition(judged) ? DoesNotFollow(sequence) : judged;
              });
}

void SendRemovalOfParts(PostgresWriter& writer, const JournalEntry& entry,
                        const PostgresOwner& owner) {
  writer.Send(kRemoveParts, PostgresParameters()
                                .Add(entry.session)
                                .Add(entry.place.sequence)
                                .Add(owner.node)
                                .Add(owner.epoch));
}

void SendSnapshot(PostgresWriter& writer, int64_t session, const JournalSnapshot& snapshot,
                  const PostgresOwner& owner) {
  writer.Send(kReplaceSnapshot, PostgresParameters()
                                    .Add(session)
                                    .Add(snapshot.sequence)
                                    .Add(snapshot.rows)
                                    .AddBytes(snapshot.state)
                                    .Add(owner.node)
                                    .Add(owner.epoch));
}

void SendHistoryPoint(PostgresWriter& writer, int64_t session, const JournalHistoryPoint& point,
                      int64_t stride, const PostgresOwner& owner) {
  writer.Send(kInsertHistoryPoint, PostgresParameters()
                                       .Add(session)
                                       .Add(point.ordinal)
                                       .Add(point.sequence)
                                       .AddBytes(point.point)
                                       .Add(owner.node)
                                       .Add(owner.epoch));
  if (stride == 1) return;
  writer.Send(kThinHistory,
              PostgresParameters().Add(session).Add(stride).Add(owner.node).Add(owner.epoch));
}

}  // namespace polyest::internal
