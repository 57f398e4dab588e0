#include "server/journal/session_row.h"

#include <absl/strings/str_format.h>

#include "core/common/status.h"

namespace polyest::internal {

absl::StatusOr<v1::Problem> ProblemIn(const SessionRow& row) {
  v1::Problem problem;
  if (!row.damaged && problem.ParseFromString(row.problem)) return problem;
  return absl::DataLossError(
      absl::StrFormat("%s is damaged in the journal: its name, its window or its problem is not "
                      "what was stored",
                      row.head.name));
}

absl::StatusOr<std::optional<SessionRow>> FindSessionRow(SqliteDatabase& database,
                                                         int64_t session) {
  SqliteQuery query(database, "SELECT " POLYEST_ROW_COLUMNS " FROM session WHERE number = ?");
  query.Bind(session);
  POLYEST_ASSIGN_OR_RETURN(const bool there, query.Step());
  if (!there) return std::nullopt;
  return ReadSessionRow(query);
}

}  // namespace polyest::internal
