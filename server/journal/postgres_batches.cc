#include "server/journal/postgres_batches.h"

#include <iterator>
#include <set>
#include <string_view>
#include <utility>

namespace polyest::internal {
namespace {

constexpr char kLockOwners[] =
    "SELECT 1 FROM unnest($1::bigint[], $2::bigint[], $3::bigint[]) AS wanted (session, node, "
    "epoch) JOIN owner USING (session, node, epoch) FOR SHARE OF owner";
// The statement does not see what it inserts: the batches ahead of one are counted by the client.
constexpr char kInsertBatches[] =
    "INSERT INTO batch "
    "SELECT given.session, given.sequence, given.measurements, given.digest, given.samples, "
    "given.rows, given.run, given.time_s, given.bytes + coalesce((SELECT place_bytes FROM batch "
    "WHERE batch.session = given.session AND batch.sequence = given.sequence - 1 - given.ahead), "
    "0), given.parts "
    "FROM unnest($1::bigint[], $2::bigint[], $3::bytea[], $4::bytea[], $5::bigint[], $6::bigint[], "
    "$7::bigint[], $8::double precision[], $9::bigint[], $10::bigint[], $11::bigint[], "
    "$12::bigint[], $13::bigint[]) AS given (session, sequence, measurements, digest, samples, "
    "rows, run, time_s, bytes, parts, ahead, node, epoch) JOIN owner USING (session, node, epoch) "
    "WHERE given.sequence - given.ahead = 1 + (SELECT coalesce(max(sequence), 0) FROM batch WHERE "
    "batch.session = given.session) AND (given.parts = 0 OR given.parts = (SELECT count(*) FROM "
    "part WHERE part.session = given.session AND part.sequence = given.sequence AND number <= "
    "given.parts)) "
    "RETURNING session, sequence";
constexpr char kWhyRefused[] =
    "SELECT false, EXISTS (SELECT 1 FROM owner WHERE session = $1 AND node = $2 AND epoch = $3), "
    "EXISTS (SELECT 1 FROM session WHERE number = $1)";

}  // namespace

const PostgresBatches::Batch* PostgresBatches::LastOf(int64_t session) const {
  const auto found = last_.find(session);
  return found == last_.end() ? nullptr : &batches_[found->second];
}

bool PostgresBatches::Take(const JournalEntry& entry, const BatchPart& last,
                           const PostgresOwner& owner) const {
  if (batches_.empty()) return true;
  if (last.number > 1 || batches_.back().last.number > 1) return false;
  const Batch* const before = LastOf(entry.session);
  return before == nullptr ||
         (before->owner == owner && before->entry->place.sequence + 1 == entry.place.sequence);
}

void PostgresBatches::Add(const JournalEntry& entry, const BatchPart& last,
                          const PostgresOwner& owner) {
  Batch batch{.entry = &entry, .last = last, .owner = owner};
  if (const Batch* const before = LastOf(entry.session)) {
    batch.ahead = before->ahead + 1;
    batch.bytes_ahead = before->bytes_ahead + std::ssize(before->entry->measurements);
  }
  last_[entry.session] = batches_.size();
  batches_.push_back(batch);
}

std::vector<PostgresStatement> PostgresBatches::Statements() const { return {Lock(), Insert()}; }

PostgresStatement PostgresBatches::Lock() const {
  std::vector<int64_t> sessions, nodes, epochs;
  for (const Batch& batch : batches_) {
    if (batch.ahead > 0) continue;
    sessions.push_back(batch.entry->session);
    nodes.push_back(batch.owner.node);
    epochs.push_back(batch.owner.epoch);
  }
  return {kLockOwners, PostgresParameters().Add(sessions).Add(nodes).Add(epochs)};
}

PostgresStatement PostgresBatches::Insert() const {
  std::vector<int64_t> sessions, sequences, samples, rows, runs, bytes, parts, ahead, nodes, epochs;
  std::vector<double> times;
  std::vector<std::string_view> measurements, digests;
  for (const Batch& batch : batches_) {
    const JournalEntry& entry = *batch.entry;
    sessions.push_back(entry.session);
    sequences.push_back(entry.place.sequence);
    measurements.push_back(batch.last.bytes);
    digests.push_back(entry.digest);
    samples.push_back(entry.place.samples);
    rows.push_back(entry.place.rows);
    runs.push_back(entry.place.last_row.run);
    times.push_back(entry.place.last_row.time_s);
    bytes.push_back(batch.bytes_ahead + std::ssize(entry.measurements));
    parts.push_back(batch.last.number - 1);
    ahead.push_back(batch.ahead);
    nodes.push_back(batch.owner.node);
    epochs.push_back(batch.owner.epoch);
  }
  return {kInsertBatches, PostgresParameters()
                              .Add(sessions)
                              .Add(sequences)
                              .AddBytes(measurements)
                              .AddBytes(digests)
                              .Add(samples)
                              .Add(rows)
                              .Add(runs)
                              .Add(times)
                              .Add(bytes)
                              .Add(parts)
                              .Add(ahead)
                              .Add(nodes)
                              .Add(epochs)};
}

std::vector<bool> PostgresBatches::Inserted(const PostgresResult& result) const {
  std::set<std::pair<int64_t, int64_t>> inserted;
  for (int row = 0; row < result.rows(); ++row) {
    inserted.emplace(result.Integer(row, 0), result.Integer(row, 1));
  }
  std::vector<bool> each;
  for (const Batch& batch : batches_) {
    each.push_back(inserted.count({batch.entry->session, batch.entry->place.sequence}) > 0);
  }
  return each;
}

PostgresStatement PostgresBatches::Why(size_t batch) const {
  const Batch& refused = batches_[batch];
  return {kWhyRefused, PostgresParameters()
                           .Add(refused.entry->session)
                           .Add(refused.owner.node)
                           .Add(refused.owner.epoch)};
}

absl::Status PostgresBatches::Judge(size_t batch, const PostgresResult& why) const {
  return JudgeBatch(why, batches_[batch].entry->place.sequence);
}

}  // namespace polyest::internal
