#pragma once

// The rows of the sessions in a journal's database, SQLite's or PostgreSQL's: which columns are
// read, and how. A query names the columns by these macros, because a statement is one literal,
// which must live as long as its connection.

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>

#include "server/journal/session_digest.h"
#include "server/journal/session_journal.h"
#include "server/journal/sqlite_database.h"

// The columns that ReadSessionHead reads, of the table `session`.
#define POLYEST_HEAD_COLUMNS "number, tenant, name, created_s, created_ns, reorder_window_s"
// The columns that ReadSessionRow reads, of the same table.
#define POLYEST_ROW_COLUMNS POLYEST_HEAD_COLUMNS ", hidden, problem, session.digest"
// The columns that ReadSessionPlace reads, of the session's last batch, which may be missing.
#define POLYEST_PLACE_COLUMNS                                                    \
  "coalesce(sequence, 0), coalesce(place_samples, 0), coalesce(place_rows, 0), " \
  "coalesce(place_run, 0), coalesce(place_time_s, 0)"

namespace polyest::internal {

inline constexpr int kHeadColumns = 6;
inline constexpr int kRowColumns = 9;
inline constexpr int kPlaceColumns = 5;

// Holds a session's row.
struct SessionRow {
  SessionHead head;  // without its place
  bool hidden = false;
  std::string problem;  // serialized
  bool damaged = false;
};

// The following read the present row of a query, which is a SqliteQuery or a PostgresRow.

// Returns a head without its place from the first columns, POLYEST_HEAD_COLUMNS.
template <typename Query>
SessionHead ReadSessionHead(const Query& query) {
  SessionHead head;
  head.number = query.Integer(0);
  head.tenant = query.Bytes(1);
  head.name = query.Bytes(2);
  head.create_time.set_seconds(query.Integer(3));
  head.create_time.set_nanos(static_cast<int32_t>(query.Integer(4)));
  head.reorder_window_s = query.Real(5);
  return head;
}

// Returns a row from the first columns, POLYEST_ROW_COLUMNS.
template <typename Query>
SessionRow ReadSessionRow(const Query& query) {
  SessionRow row{.head = ReadSessionHead(query),
                 .hidden = query.Flag(kHeadColumns),
                 .problem = query.Bytes(kHeadColumns + 1)};
  row.damaged = query.Bytes(kHeadColumns + 2) != SessionDigest(row.head, row.hidden, row.problem);
  return row;
}

// Returns a place from the columns POLYEST_PLACE_COLUMNS, of which `first` is the first.
template <typename Query>
SessionPlace ReadSessionPlace(const Query& query, int first) {
  SessionPlace place;
  place.sequence = query.Integer(first);
  place.samples = query.Integer(first + 1);
  place.rows = query.Integer(first + 2);
  place.last_row = {static_cast<int>(query.Integer(first + 3)), query.Real(first + 4)};
  return place;
}

// Returns the problem that a row holds; DATA_LOSS if the row is damaged.
absl::StatusOr<v1::Problem> ProblemIn(const SessionRow& row);

// Returns the row of a session; nothing if there is no such session.
absl::StatusOr<std::optional<SessionRow>> FindSessionRow(SqliteDatabase& database, int64_t session);

}  // namespace polyest::internal
