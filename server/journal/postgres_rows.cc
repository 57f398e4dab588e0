#include "server/journal/postgres_rows.h"

#include <utility>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Number of heads that one statement gives.
constexpr int64_t kHeadsOfPage = 500;

// The columns of a head, and where they come from.
#define POLYEST_HEADS                                                                            \
  "SELECT " POLYEST_HEAD_COLUMNS ", " POLYEST_PLACE_COLUMNS                                      \
  ", octet_length(problem) + coalesce(place_bytes, 0), "                                         \
  "coalesce((SELECT octet_length(state)::bigint FROM snapshot WHERE session = number), 0) FROM " \
  "session LEFT JOIN LATERAL (SELECT * FROM batch WHERE "                                        \
  "batch.session = session.number ORDER BY sequence DESC LIMIT 1) last ON true WHERE NOT hidden "

constexpr char kHeads[] =
    POLYEST_HEADS "AND (tenant, name) > ($1, $2) ORDER BY tenant, name LIMIT $3";
constexpr char kHeadsOfTenant[] =
    POLYEST_HEADS "AND tenant = $1 AND name > $2 ORDER BY name LIMIT $3";
constexpr char kHeadOf[] = POLYEST_HEADS "AND tenant = $1 AND name = $2";
#undef POLYEST_HEADS

constexpr char kRow[] = "SELECT " POLYEST_ROW_COLUMNS " FROM session WHERE number = $1";
// One statement looks for the session and for its batches, because the session may be deleted and
// its batches removed between two. A page has at most 8 MiB, or one batch. Before the last part of
// a batch stand those that are kept apart (batch_parts.h).
constexpr char kPage[] =
    "SELECT coalesce(sequence, 0), CASE WHEN parts > 0 THEN (SELECT string_agg(bytes, ''::bytea "
    "ORDER BY part.number) FROM part WHERE part.session = $1 AND part.sequence = page.sequence AND "
    "part.number <= parts) || measurements ELSE measurements END, page.digest FROM session LEFT "
    "JOIN LATERAL (SELECT * FROM (SELECT sequence, measurements, parts, batch.digest, "
    "sum(octet_length(measurements) + 262144 * parts) OVER "
    "(ORDER BY sequence) AS size FROM (SELECT * FROM batch WHERE batch.session = $1 AND sequence > "
    "$2 ORDER BY sequence LIMIT 256) batch) summed WHERE size <= 8388608 OR sequence = $2 + 1) "
    "page ON true WHERE number = $1 ORDER BY 1";

SessionHead HeadIn(const PostgresResult& result, int number) {
  const PostgresRow row(result, number);
  SessionHead head = ReadSessionHead(row);
  head.place = ReadSessionPlace(row, kHeadColumns);
  head.bytes = row.Integer(kHeadColumns + kPlaceColumns);
  head.snapshot_bytes = row.Integer(kHeadColumns + kPlaceColumns + 1);
  return head;
}

}  // namespace

absl::StatusOr<std::vector<SessionHead>> ReadHeads(PostgresPool& pool) {
  std::vector<SessionHead> heads;
  std::string tenant, name;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(
        const PostgresResult page,
        pool.Query(kHeads, PostgresParameters().AddText(tenant).AddText(name).Add(kHeadsOfPage)));
    for (int row = 0; row < page.rows(); ++row) heads.push_back(HeadIn(page, row));
    if (page.rows() < kHeadsOfPage) return heads;
    tenant = heads.back().tenant;
    name = heads.back().name;
  }
}

absl::StatusOr<std::vector<SessionHead>> ReadHeadsAfter(PostgresPool& pool,
                                                        const std::string& tenant,
                                                        const std::string& after, int64_t count) {
  POLYEST_ASSIGN_OR_RETURN(
      const PostgresResult page,
      pool.Query(kHeadsOfTenant, PostgresParameters().AddText(tenant).AddText(after).Add(count)));
  std::vector<SessionHead> heads;
  for (int row = 0; row < page.rows(); ++row) heads.push_back(HeadIn(page, row));
  return heads;
}

absl::StatusOr<std::optional<SessionHead>> FindHead(PostgresPool& pool, const std::string& tenant,
                                                    const std::string& name) {
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult found,
                           pool.Query(kHeadOf, PostgresParameters().AddText(tenant).AddText(name)));
  if (found.rows() == 0) return std::nullopt;
  return HeadIn(found, 0);
}

absl::StatusOr<SessionRow> ReadRow(PostgresPool& pool, int64_t session) {
  POLYEST_ASSIGN_OR_RETURN(const PostgresResult found,
                           pool.Query(kRow, PostgresParameters().Add(session)));
  if (found.rows() == 0) return NoSuchSession();
  return ReadSessionRow(PostgresRow(found, 0));
}

absl::StatusOr<PostgresResult> ReadPage(PostgresPool& pool, int64_t session, int64_t after) {
  POLYEST_ASSIGN_OR_RETURN(PostgresResult page,
                           pool.Query(kPage, PostgresParameters().Add(session).Add(after)));
  if (page.rows() == 0) return NoSuchSession();
  return page;
}

}  // namespace polyest::internal
