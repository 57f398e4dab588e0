#include "server/journal/sqlite_writes.h"

#include <absl/strings/str_format.h>

#include "core/common/status.h"

namespace polyest::internal {

absl::Status RunForSession(SqliteDatabase& database, const char* sql, int64_t session) {
  SqliteQuery query(database, sql);
  query.Bind(session);
  return query.Run();
}

absl::StatusOr<std::vector<int64_t>> FirstRows(SqliteQuery& query, int64_t bytes) {
  std::vector<int64_t> rows;
  for (int64_t found = 0; found < bytes; found += query.Integer(1)) {
    POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) break;
    rows.push_back(query.Integer(0));
  }
  return rows;
}

absl::StatusOr<bool> RunForRows(SqliteDatabase& database, const char* sql,
                                const std::vector<int64_t>& rows) {
  for (const int64_t row : rows) {
    SqliteQuery query(database, sql);
    query.Bind(row);
    POLYEST_RETURN_IF_ERROR(query.Run());
  }
  return !rows.empty();
}

absl::Status BatchRefused(SqliteDatabase& database, const JournalEntry& entry) {
  SqliteQuery session(database, "SELECT 1 FROM session WHERE number = ?");
  session.Bind(entry.session);
  POLYEST_ASSIGN_OR_RETURN(const bool there, session.Step());
  if (!there) return NoSuchSession();
  return absl::FailedPreconditionError(
      absl::StrFormat("batch %d does not follow what the journal has", entry.place.sequence));
}

absl::Status InsertBatch(SqliteDatabase& database, const JournalEntry& entry,
                         const BatchPart& last) {
  SqliteQuery query(
      database,
      "INSERT INTO batch SELECT ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9 + coalesce("
      "(SELECT place_bytes FROM batch WHERE session = ?1 AND sequence = ?2 - 1), 0), ?10 "
      "WHERE ?2 = 1 + (SELECT coalesce(max(sequence), 0) FROM batch WHERE session = ?1) AND "
      "EXISTS (SELECT 1 FROM session WHERE number = ?1) AND (?10 = 0 OR ?10 = "
      "(SELECT count(*) FROM part WHERE session = ?1 AND sequence = ?2 AND number <= ?10))");
  query.Bind(entry.session)
      .Bind(entry.place.sequence)
      .BindBlob(last.bytes)
      .BindBlob(entry.digest)
      .Bind(entry.place.samples)
      .Bind(entry.place.rows)
      .Bind(static_cast<int64_t>(entry.place.last_row.run))
      .Bind(entry.place.last_row.time_s)
      .Bind(static_cast<int64_t>(entry.measurements.size()))
      .Bind(last.number - 1);
  POLYEST_RETURN_IF_ERROR(query.Run());
  return database.changes() > 0 ? absl::OkStatus() : BatchRefused(database, entry);
}

absl::Status ReplaceSnapshot(SqliteDatabase& database, int64_t session,
                             const JournalSnapshot& snapshot) {
  SqliteQuery query(database,
                    "INSERT OR REPLACE INTO snapshot SELECT ?1, ?2, ?3, ?4 WHERE EXISTS "
                    "(SELECT 1 FROM batch WHERE session = ?1 AND sequence = ?2)");
  query.Bind(session).Bind(snapshot.sequence).Bind(snapshot.rows).BindBlob(snapshot.state);
  return query.Run();
}

absl::Status InsertHistoryPoint(SqliteDatabase& database, int64_t session,
                                const JournalHistoryPoint& point, int64_t stride) {
  SqliteQuery insert(database,
                     "INSERT OR REPLACE INTO history SELECT ?1, ?2, ?3, ?4 WHERE EXISTS "
                     "(SELECT 1 FROM batch WHERE session = ?1 AND sequence = ?3)");
  insert.Bind(session).Bind(point.ordinal).Bind(point.sequence).BindBlob(point.point);
  POLYEST_RETURN_IF_ERROR(insert.Run());
  if (stride == 1) return absl::OkStatus();
  SqliteQuery thin(database, "DELETE FROM history WHERE session = ? AND ordinal % ? <> 0");
  thin.Bind(session).Bind(stride);
  return thin.Run();
}

}  // namespace polyest::internal
