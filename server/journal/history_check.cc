#include "server/journal/history_check.h"

#include <absl/strings/str_cat.h>

#include <cstdint>
#include <map>
#include <utility>

#include "core/common/status.h"
#include "polyest/v1/estimate.pb.h"
#include "server/digest/digest.h"
#include "server/journal/seal_check.h"

namespace polyest::internal {
namespace {

struct History {
  std::string text;  // of all points, with their lengths, so that two histories never have the same
  bool readable = true;
};

// Returns the digest of each session's history; an empty one if a point of it cannot be read.
absl::StatusOr<std::map<int64_t, std::string>> Digests(SqliteDatabase& database) {
  std::map<int64_t, History> histories;
  SqliteQuery query(
      database, "SELECT session, ordinal, sequence, point FROM history ORDER BY session, ordinal");
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
    if (!more) break;
    History& history = histories[query.Integer(0)];
    const std::string point = query.Bytes(3);
    history.readable = history.readable && v1::EstimateHistory::Point().ParseFromString(point);
    absl::StrAppend(&history.text, query.Integer(1), " ", query.Integer(2), " ", point.size(), "\n",
                    point);
  }
  std::map<int64_t, std::string> digests;
  for (const auto& [session, history] : histories) {
    digests[session] = history.readable ? Digest(history.text) : "";
  }
  return digests;
}

absl::StatusOr<bool> HasDigests(SqliteDatabase& database) {
  POLYEST_ASSIGN_OR_RETURN(
      const int64_t tables,
      database.Number("SELECT count(*) FROM sqlite_schema WHERE name = 'backup_history'"));
  return tables > 0;
}

absl::StatusOr<std::map<int64_t, std::string>> KeptDigests(SqliteDatabase& database) {
  std::map<int64_t, std::string> digests;
  SqliteQuery query(database, "SELECT session, digest FROM backup_history");
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
    if (!more) return digests;
    digests[query.Integer(0)] = query.Bytes(1);
  }
}

}  // namespace

absl::Status WriteHistoryDigests(SqliteDatabase& database) {
  POLYEST_ASSIGN_OR_RETURN(const auto digests, Digests(database));
  POLYEST_RETURN_IF_ERROR(database.Execute(
      "BEGIN; CREATE TABLE backup_history (session INTEGER PRIMARY KEY, digest BLOB)"));
  for (const auto& [session, digest] : digests) {
    SqliteQuery query(database, "INSERT INTO backup_history VALUES (?, ?)");
    query.Bind(session).BindBlob(digest);
    POLYEST_RETURN_IF_ERROR(query.Run());
  }
  return database.Execute("COMMIT");
}

absl::Status DropHistoryDigests(SqliteDatabase& database) {
  return database.Execute("DROP TABLE IF EXISTS backup_history");
}

absl::Status CheckHistories(SqliteDatabase& database, std::vector<std::string>& damage) {
  POLYEST_ASSIGN_OR_RETURN(const auto digests, Digests(database));
  POLYEST_ASSIGN_OR_RETURN(const bool has_kept, HasDigests(database));
  std::map<int64_t, std::string> kept = digests;
  if (has_kept) {
    POLYEST_ASSIGN_OR_RETURN(kept, KeptDigests(database));
  }
  SqliteQuery query(database, "SELECT number, tenant, name FROM session ORDER BY number");
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
    if (!more) return absl::OkStatus();
    const auto found = digests.find(query.Integer(0));
    const auto wanted = kept.find(query.Integer(0));
    const bool there = found != digests.end();
    const bool unreadable = there && found->second.empty();
    const bool same =
        there == (wanted != kept.end()) && (!there || found->second == wanted->second);
    if (same && !unreadable) continue;
    damage.push_back(absl::StrCat(SealLabel(query.Bytes(1), query.Bytes(2)),
                                  unreadable
                                      ? ": a point of its history of estimates is damaged"
                                      : ": its history of estimates is not the one of the backup"));
  }
}

}  // namespace polyest::internal
