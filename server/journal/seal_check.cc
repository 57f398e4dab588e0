#include "server/journal/seal_check.h"

#include <absl/strings/str_format.h>

#include <set>
#include <utility>

#include "core/common/status.h"
#include "server/journal/session_digest.h"
#include "server/journal/session_row.h"

namespace polyest::internal {
namespace {

// Adds to a seal the batches that the database has and the seal has not.
absl::Status BringUpToDate(SqliteDatabase& database, Seal seal, SessionSeals& seals) {
  SqliteQuery query(database,
                    "SELECT sequence, digest FROM batch WHERE session = ? AND sequence > ? ORDER "
                    "BY sequence");
  query.Bind(seal.session).Bind(seal.sequence);
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) break;
    seal.Add(query.Integer(0), query.Bytes(1));
  }
  seals.Put(seal);
  return absl::OkStatus();
}

absl::Status CheckSession(SqliteDatabase& database, const SessionRow& row, int64_t sequence,
                          SessionSeals& seals, std::vector<std::string>& found) {
  const std::string label = SealLabel(row.head.tenant, row.head.name);
  const std::optional<Seal> seal = seals.Of(row.head.number);
  if (row.damaged) {
    // The name may be what is damaged; the seal has that which was acknowledged.
    const std::string& known = seal && !seal->label.empty() ? seal->label : label;
    found.push_back(known + ": its name, its window or its problem is damaged; it is not served");
    return absl::OkStatus();
  }
  const std::string head = SessionDigest(row.head, /*hidden=*/false, row.problem);
  if (!seal || seal->head != head) {
    seals.Put(Seal::At(row.head.number, label, head, sequence));
  } else if (seal->sequence > sequence) {
    found.push_back(absl::StrFormat("%s: batches %d to %d were acknowledged and are missing", label,
                                    sequence + 1, seal->sequence));
  } else if (seal->sequence < sequence) {
    return BringUpToDate(database, *seal, seals);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::set<int64_t>> DeletedSessions(SqliteDatabase& database) {
  std::set<int64_t> deleted;
  SqliteQuery query(database, "SELECT session FROM deleted");
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return deleted;
    deleted.insert(query.Integer(0));
  }
}

}  // namespace

std::string SealLabel(const std::string& tenant, const std::string& name) {
  return tenant.empty() ? name : absl::StrFormat("%s of tenant %s", name, tenant);
}

absl::StatusOr<std::vector<std::string>> CheckSeals(SqliteDatabase& database, SessionSeals& seals) {
  std::vector<std::string> found;
  if (seals.damaged() > 0) {
    found.push_back(absl::StrFormat(
        "the file of seals: %d entries are damaged, so that batches of as many sessions may be "
        "missing without a word",
        seals.damaged()));
  }
  std::set<int64_t> there;
  SqliteQuery query(database,
                    "SELECT " POLYEST_ROW_COLUMNS
                    ", coalesce((SELECT max(sequence) FROM batch WHERE session = number), 0) FROM "
                    "session");
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
    if (!more) break;
    const SessionRow row = ReadSessionRow(query);
    there.insert(row.head.number);
    POLYEST_RETURN_IF_ERROR(CheckSession(database, row, query.Integer(kRowColumns), seals, found));
  }
  POLYEST_ASSIGN_OR_RETURN(const std::set<int64_t> deleted, DeletedSessions(database));
  for (const Seal& seal : seals.All()) {
    if (there.contains(seal.session)) continue;
    if (deleted.contains(seal.session)) {
      seals.Remove(seal.session);
    } else {
      found.push_back(absl::StrFormat("%s: it was acknowledged with %d batches and is missing",
                                      seal.label, seal.sequence));
    }
  }
  return found;
}

}  // namespace polyest::internal
