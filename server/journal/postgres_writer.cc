#include "server/journal/postgres_writer.h"

#include "core/common/status.h"
#include "server/journal/postgres_status.h"

namespace polyest::internal {
namespace {

// After a failed attempt, everybody is refused at once for so long.
constexpr std::chrono::milliseconds kPauseBetweenAttempts{250};

}  // namespace

void PostgresWriter::Send(const char* sql, PostgresParameters parameters, Judge judge) {
  sent_.push_back(
      {.write = write_, .statement = {sql, std::move(parameters)}, .judge = std::move(judge)});
}

void PostgresWriter::SendBatch(const PostgresBatch& batch) {
  batches_.Add(batch);
  sent_.push_back({.write = write_, .batch = batch});
}

void PostgresWriter::EndBatches(int64_t session, const PostgresOwner& owner) {
  sent_.push_back({.write = write_, .ended = session, .owner = owner});
}

absl::Status PostgresWriter::Connect() {
  if (connection_ != nullptr) return absl::OkStatus();
  if (std::chrono::steady_clock::now() < next_attempt_) return DatabaseAway("no connection");
  auto connection = PostgresConnection::Open(target_);
  next_attempt_ = std::chrono::steady_clock::now() + kPauseBetweenAttempts;
  POLYEST_RETURN_IF_ERROR(connection.status());
  // The server keeps one plan for all groups, since planning anew for each takes longer than the
  // look itself. It ends the transaction of a daemon that stands still after the look before the
  // daemon's lease is over, so that nobody who takes a session over waits for its locks.
  POLYEST_RETURN_IF_ERROR((*connection)
                              ->Execute("SET plan_cache_mode = force_generic_plan; "
                                        "SET idle_in_transaction_session_timeout = 2000"));
  connection_ = *std::move(connection);
  return absl::OkStatus();
}

absl::Status PostgresWriter::Commit(const std::vector<Write>& writes,
                                    std::vector<absl::Status>& outcomes) {
  for (bool again = true; again;) {
    again = false;
    Collect(writes, outcomes);
    if (sent_.empty()) return absl::OkStatus();
    POLYEST_RETURN_IF_ERROR(Connect());
    const absl::Status run = Run(outcomes, again);
    if (again) continue;
    if (!run.ok()) connection_ = nullptr;
    return run;
  }
  return absl::OkStatus();
}

void PostgresWriter::Collect(const std::vector<Write>& writes,
                             std::vector<absl::Status>& outcomes) {
  sent_.clear();
  batches_ = {};
  for (write_ = 0; write_ < writes.size(); ++write_) {
    if (outcomes[write_].ok()) outcomes[write_] = writes[write_](*this);
  }
}

absl::Status PostgresWriter::Begin() {
  if (batches_.empty()) return absl::OkStatus();
  PostgresConnection::Refused refused;
  POLYEST_ASSIGN_OR_RETURN(const std::vector<PostgresResult> results,
                           connection_->Pipeline({{"BEGIN"}, batches_.Look()}, refused));
  batches_.Found(results.back());
  return absl::OkStatus();
}

std::vector<PostgresStatement> PostgresWriter::Statements(std::vector<absl::Status>& outcomes,
                                                          std::vector<size_t>& sent) {
  std::vector<PostgresStatement> statements;
  for (size_t i = 0; i < sent_.size(); ++i) {
    Sent& one = sent_[i];
    if (one.ended) {
      batches_.Delete(*one.ended, one.owner);
      continue;
    }
    if (one.batch) {
      auto insert = batches_.Insert(*one.batch);
      if (!insert.ok()) {
        outcomes[one.write] = insert.status();
        continue;
      }
      one.statement = *std::move(insert);
      one.judge = [batch = *one.batch](const PostgresResult& result) {
        return PostgresBatches::JudgeInsert(batch, result);
      };
    }
    statements.push_back(std::move(one.statement));
    sent.push_back(i);
  }
  statements.push_back({"COMMIT"});
  return statements;
}

// Runs the group. Sets `again` when it has been undone because of one write, whose outcome is known
// now, and the others can be tried without it.
absl::Status PostgresWriter::Run(std::vector<absl::Status>& outcomes, bool& again) {
  connection_->TakeWarning();
  POLYEST_RETURN_IF_ERROR(Begin());
  std::vector<size_t> sent;
  std::vector<PostgresStatement> statements = Statements(outcomes, sent);
  const size_t begin = batches_.empty() ? 1 : 0;  // number of statements before those of sent_
  if (begin > 0) statements.insert(statements.begin(), {"BEGIN"});
  PostgresConnection::Refused refused;
  const auto results = connection_->Pipeline(statements, refused);
  if (!results.ok()) {
    again = !connection_->broken() && refused.taken && refused.statement >= begin &&
            refused.statement < begin + sent.size() && connection_->Execute("ROLLBACK").ok();
    if (again) outcomes[sent_[sent[refused.statement - begin]].write] = results.status();
    return results.status();
  }
  // A server that no longer waits for its standby, because it was told to shut down, only warns.
  if (results->back().command() != "COMMIT" || connection_->TakeWarning()) {
    return DatabaseAway("it has not confirmed a commit");
  }
  for (size_t i = 0; i < sent.size(); ++i) {
    const Sent& one = sent_[sent[i]];
    if (!one.judge || !outcomes[one.write].ok()) continue;
    outcomes[one.write] = one.judge((*results)[begin + i]);
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
