#include "server/journal/postgres_writer.h"

#include "core/common/status.h"
#include "server/journal/postgres_status.h"

namespace polyest::internal {
namespace {

// After a failed attempt, everybody is refused at once for so long.
constexpr std::chrono::milliseconds kPauseBetweenAttempts{250};

}  // namespace

void PostgresWriter::Send(const char* sql, PostgresParameters parameters, Judge judge) {
  SendGathered();
  statements_.push_back({sql, std::move(parameters)});
  sent_.push_back({write_, std::move(judge)});
}

void PostgresWriter::SendBatch(const JournalEntry& entry, const BatchPart& last,
                               const PostgresOwner& owner) {
  if (!gathered_.batches.Take(entry, last, owner)) SendGathered();
  gathered_.batches.Add(entry, last, owner);
  gathered_.writes.push_back(write_);
}

void PostgresWriter::SendGathered() {
  if (gathered_.batches.empty()) return;
  for (PostgresStatement& statement : gathered_.batches.Statements()) {
    statements_.push_back(std::move(statement));
    sent_.push_back({});
  }
  gathered_.statement = statements_.size() - 1;
  together_.push_back(std::exchange(gathered_, {}));
}

absl::Status PostgresWriter::Connect() {
  if (connection_ != nullptr) return absl::OkStatus();
  if (std::chrono::steady_clock::now() < next_attempt_) return DatabaseAway("no connection");
  auto connection = PostgresConnection::Open(target_);
  next_attempt_ = std::chrono::steady_clock::now() + kPauseBetweenAttempts;
  POLYEST_RETURN_IF_ERROR(connection.status());
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
  statements_ = {{"BEGIN"}};
  sent_.clear();
  together_.clear();
  for (write_ = 0; write_ < writes.size(); ++write_) {
    if (outcomes[write_].ok()) outcomes[write_] = writes[write_](*this);
  }
  SendGathered();
  statements_.push_back({"COMMIT"});
}

// Runs the group. Sets `again` when it has been undone because of one write, whose outcome is known
// now, and the others can be tried without it.
absl::Status PostgresWriter::Run(std::vector<absl::Status>& outcomes, bool& again) {
  connection_->TakeWarning();
  PostgresConnection::Refused refused;
  const auto results = connection_->Pipeline(statements_, refused);
  if (!results.ok()) {
    const bool one = refused.taken && refused.statement > 0 && refused.statement <= sent_.size() &&
                     sent_[refused.statement - 1].write;
    again = one && !connection_->broken() && connection_->Execute("ROLLBACK").ok();
    if (again) outcomes[*sent_[refused.statement - 1].write] = results.status();
    return results.status();
  }
  // A server that no longer waits for its standby, because it was told to shut down, only warns.
  if (results->back().command() != "COMMIT" || connection_->TakeWarning()) {
    return DatabaseAway("it has not confirmed a commit");
  }
  for (size_t i = 0; i < sent_.size(); ++i) {
    if (!sent_[i].judge || !outcomes[*sent_[i].write].ok()) continue;
    outcomes[*sent_[i].write] = sent_[i].judge((*results)[i + 1]);
  }
  for (const Together& sent : together_) JudgeBatches(sent, (*results)[sent.statement], outcomes);
  return absl::OkStatus();
}

// Asks the database why a batch was not inserted, which is rare.
void PostgresWriter::JudgeBatches(const Together& sent, const PostgresResult& result,
                                  std::vector<absl::Status>& outcomes) {
  const std::vector<bool> inserted = sent.batches.Inserted(result);
  for (size_t i = 0; i < inserted.size(); ++i) {
    if (inserted[i]) continue;
    const PostgresStatement question = sent.batches.Why(i);
    const auto why = connection_->broken() ? DatabaseAway("the connection was lost")
                                           : connection_->Query(question.sql, question.parameters);
    outcomes[sent.writes[i]] = why.ok() ? sent.batches.Judge(i, *why) : why.status();
  }
}

}  // namespace polyest::internal
