#include "server/journal/postgres_batches.h"

#include <iterator>
#include <vector>

namespace polyest::internal {
namespace {

constexpr char kLookAtSessions[] =
    "WITH held AS MATERIALIZED (SELECT session FROM unnest($1::bigint[], $2::bigint[], "
    "$3::bigint[]) AS wanted (session, node, epoch) JOIN owner USING (session, node, epoch) "
    "FOR SHARE OF owner) "
    "SELECT wanted.session, wanted.session IN (SELECT session FROM held), EXISTS (SELECT 1 FROM "
    "session WHERE number = wanted.session), last.sequence, last.place_bytes "
    "FROM unnest($1::bigint[]) AS wanted (session) LEFT JOIN LATERAL (SELECT sequence, place_bytes "
    "FROM batch WHERE batch.session = wanted.session ORDER BY sequence DESC LIMIT 1) AS last ON "
    "true";
constexpr char kInsertBatch[] =
    "INSERT INTO batch VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)";
// Inserts a batch in parts; the database alone knows whether all of them are there.
constexpr char kInsertBatchIfWhole[] =
    "INSERT INTO batch SELECT $1, $2, $3, $4, $5, $6, $7, $8, $9, $10 WHERE ($2 = 1 OR EXISTS "
    "(SELECT 1 FROM batch WHERE session = $1 AND sequence = $2 - 1)) AND $10 = (SELECT count(*) "
    "FROM part WHERE session = $1 AND sequence = $2 AND number <= $10)";

}  // namespace

void PostgresBatches::Add(const PostgresBatch& batch) {
  const auto [session, is_new] =
      sessions_.try_emplace(batch.entry->session, Session{.owner = batch.owner});
  // If there are two owners, only the later one can be the present one.
  if (!is_new && batch.owner.epoch > session->second.owner.epoch) {
    session->second.owner = batch.owner;
  }
}

PostgresStatement PostgresBatches::Look() const {
  std::vector<int64_t> numbers, nodes, epochs;
  for (const auto& [number, session] : sessions_) {
    numbers.push_back(number);
    nodes.push_back(session.owner.node);
    epochs.push_back(session.owner.epoch);
  }
  return {kLookAtSessions, PostgresParameters().Add(numbers).Add(nodes).Add(epochs)};
}

void PostgresBatches::Found(const PostgresResult& result) {
  for (int row = 0; row < result.rows(); ++row) {
    Session& session = sessions_.at(result.Integer(row, 0));
    session.held = result.Flag(row, 1);
    session.exists = result.Flag(row, 2);
    session.sequence = result.Integer(row, 3);
    session.bytes = result.Integer(row, 4);
  }
}

absl::StatusOr<PostgresStatement> PostgresBatches::Insert(const PostgresBatch& batch) {
  const JournalEntry& entry = *batch.entry;
  Session& session = sessions_.at(entry.session);
  if (!session.exists) return NoSuchSession();
  if (!session.held || session.owner != batch.owner) return TakenOver();
  if (entry.place.sequence != session.sequence + 1) return DoesNotFollow(entry.place.sequence);
  ++session.sequence;
  session.bytes += std::ssize(entry.measurements);
  session.in_parts = session.in_parts || batch.last.number > 1;
  return PostgresStatement{session.in_parts ? kInsertBatchIfWhole : kInsertBatch,
                           PostgresParameters()
                               .Add(entry.session)
                               .Add(entry.place.sequence)
                               .AddBytes(batch.last.bytes)
                               .AddBytes(entry.digest)
                               .Add(entry.place.samples)
                               .Add(entry.place.rows)
                               .Add(int64_t{entry.place.last_row.run})
                               .Add(entry.place.last_row.time_s)
                               .Add(session.bytes)
                               .Add(batch.last.number - 1)};
}

absl::Status PostgresBatches::JudgeInsert(const PostgresBatch& batch,
                                          const PostgresResult& result) {
  return result.changes() > 0 ? absl::OkStatus() : DoesNotFollow(batch.entry->place.sequence);
}

void PostgresBatches::Delete(int64_t session, const PostgresOwner& owner) {
  const auto found = sessions_.find(session);
  if (found == sessions_.end()) return;
  Session& deleted = found->second;
  if (deleted.held && deleted.owner == owner) deleted.exists = false;
}

}  // namespace polyest::internal
