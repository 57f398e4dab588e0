#include "server/journal/sqlite_parts.h"

#include <utility>
#include <vector>

#include "core/common/status.h"
#include "server/journal/sqlite_writes.h"

namespace polyest::internal {
namespace {

constexpr char kRemovePart[] = "DELETE FROM part WHERE rowid = ?";

}  // namespace

absl::Status InsertPart(SqliteDatabase& database, const JournalEntry& entry,
                        const BatchPart& part) {
  SqliteQuery query(
      database,
      "INSERT OR REPLACE INTO part SELECT ?1, ?2, ?3, ?4 WHERE ?2 = 1 + (SELECT "
      "coalesce(max(sequence), 0) FROM batch WHERE session = ?1) AND EXISTS (SELECT 1 FROM session "
      "WHERE number = ?1)");
  query.Bind(entry.session).Bind(entry.place.sequence).Bind(part.number).BindBlob(part.bytes);
  POLYEST_RETURN_IF_ERROR(query.Run());
  return database.changes() > 0 ? absl::OkStatus() : BatchRefused(database, entry);
}

absl::StatusOr<std::string> JoinParts(SqliteDatabase& database, int64_t session, int64_t sequence,
                                      int64_t part_count, std::string last) {
  if (part_count == 0) return last;
  SqliteQuery query(database,
                    "SELECT bytes FROM part WHERE session = ? AND sequence = ? AND number <= ? "
                    "ORDER BY number");
  query.Bind(session).Bind(sequence).Bind(part_count);
  std::string all;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
    if (!more) return std::move(all) + last;
    all += query.Bytes(0);
  }
}

absl::StatusOr<bool> RemoveSomeParts(SqliteDatabase& database, int64_t session, int64_t max_bytes) {
  std::vector<int64_t> rows;
  {
    SqliteQuery query(database, "SELECT rowid, length(bytes) FROM part WHERE session = ?");
    query.Bind(session);
    POLYEST_ASSIGN_OR_RETURN(rows, FirstRows(query, max_bytes));
  }
  return RunForRows(database, kRemovePart, rows);
}

absl::Status RemoveRefused(SqliteDatabase& database, const JournalEntry& entry) {
  SqliteQuery query(
      database,
      "DELETE FROM part WHERE session = ?1 AND sequence = ?2 AND NOT EXISTS (SELECT 1 "
      "FROM batch WHERE session = ?1 AND sequence = ?2)");
  query.Bind(entry.session).Bind(entry.place.sequence);
  return query.Run();
}

absl::Status DeleteUnfinishedParts(SqliteDatabase& database) {
  while (true) {
    std::vector<int64_t> rows;
    {
      // Those of deleted sessions are removed with them.
      SqliteQuery query(database,
                        "SELECT rowid, length(bytes) FROM part WHERE session IN (SELECT number "
                        "FROM session) AND NOT EXISTS (SELECT 1 FROM batch WHERE batch.session = "
                        "part.session AND batch.sequence = part.sequence)");
      POLYEST_ASSIGN_OR_RETURN(rows, FirstRows(query, CommitQueue<SqliteDatabase>::kMaxBytes));
    }
    if (rows.empty()) return absl::OkStatus();
    POLYEST_RETURN_IF_ERROR(database.Execute("BEGIN IMMEDIATE"));
    const absl::Status removed = RunForRows(database, kRemovePart, rows).status();
    const absl::Status kept = removed.ok() ? database.Execute("COMMIT") : removed;
    if (kept.ok()) continue;
    database.Execute("ROLLBACK").IgnoreError();
    return kept;
  }
}

}  // namespace polyest::internal
