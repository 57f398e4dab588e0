#include "server/journal/session_digest.h"

#include <absl/strings/str_format.h>

#include <vector>

#include "core/common/status.h"
#include "server/digest/digest.h"
#include "server/journal/session_row.h"

namespace polyest::internal {
namespace {

absl::Status RunFor(SqliteDatabase& database, const char* sql, int64_t session) {
  SqliteQuery query(database, sql);
  return query.Bind(session).Run();
}

}  // namespace

std::string SessionDigest(const SessionHead& head, bool hidden, std::string_view problem) {
  // The lengths keep two different rows from having the same text.
  std::string text =
      absl::StrFormat("%d %d %d %d %d %d %d %a\n", head.number, head.tenant.size(),
                      head.name.size(), problem.size(), hidden, head.create_time.seconds(),
                      head.create_time.nanos(), head.reorder_window_s);
  return Digest(text.append(head.tenant).append(head.name).append(problem));
}

absl::Status WriteSessionDigest(SqliteDatabase& database, int64_t session) {
  POLYEST_ASSIGN_OR_RETURN(const auto row, FindSessionRow(database, session));
  if (!row) return absl::OkStatus();
  const std::string digest = SessionDigest(row->head, row->hidden, row->problem);
  SqliteQuery update(database, "UPDATE session SET digest = ? WHERE number = ?");
  return update.BindBlob(digest).Bind(session).Run();
}

absl::Status WriteAllSessionDigests(SqliteDatabase& database) {
  std::vector<int64_t> sessions;
  {
    SqliteQuery query(database, "SELECT number FROM session");
    while (true) {
      POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
      if (!row) break;
      sessions.push_back(query.Integer(0));
    }
  }
  for (const int64_t session : sessions) {
    POLYEST_RETURN_IF_ERROR(WriteSessionDigest(database, session));
  }
  return absl::OkStatus();
}

absl::Status DeleteHidden(SqliteDatabase& database) {
  std::vector<int64_t> hidden;
  {
    SqliteQuery query(database, "SELECT " POLYEST_ROW_COLUMNS " FROM session WHERE hidden <> 0");
    while (true) {
      POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
      if (!more) break;
      const SessionRow row = ReadSessionRow(query);
      if (!row.damaged) hidden.push_back(row.head.number);
    }
  }
  if (hidden.empty()) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(database.Execute("BEGIN IMMEDIATE"));
  for (const int64_t session : hidden) {
    POLYEST_RETURN_IF_ERROR(RunFor(database, "INSERT INTO deleted VALUES (?)", session));
    POLYEST_RETURN_IF_ERROR(RunFor(database, "DELETE FROM session WHERE number = ?", session));
  }
  return database.Execute("COMMIT");
}

}  // namespace polyest::internal
