#include "client/cli/stream_session.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <google/protobuf/util/message_differencer.h>

#include <algorithm>
#include <map>

#include "core/common/status.h"

namespace polyest::internal {

namespace {

// Returns whether the problem is the session's. The daemon does not keep the address of its schema.
bool IsProblemOf(const v1::Session& session, const v1::Problem& problem) {
  google::protobuf::util::MessageDifferencer differencer;
  differencer.IgnoreField(
      v1::Problem::descriptor()->FindFieldByNumber(v1::Problem::kSchemaFieldNumber));
  return differencer.Compare(session.problem(), problem);
}

// Checks that a session can be resumed with this window.
absl::Status CheckWindow(const v1::Session& session, const std::string& id, double window_s) {
  if (session.reorder_window_s() != window_s) {
    return absl::AlreadyExistsError(
        absl::StrFormat("session %s already exists with a reorderWindowS of %g s, not %g s; resume "
                        "it with its own --reorder-window or choose another name",
                        id, session.reorder_window_s(), window_s));
  }
  if (window_s == 0 || session.sample_count() == 0) return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrFormat("session %s already has rows; with --reorder-window they may be out of "
                      "order, so that its last row does not tell which ones; choose another name",
                      id));
}

int RunOf(const v1::Measurements& batch, int row) {
  return batch.run().empty() ? 0 : batch.run(row);
}

// Returns the values of a row by channel, without what is missing.
std::map<std::string, double> ValuesOf(const v1::Measurements& batch, int row) {
  std::map<std::string, double> values;
  for (const v1::Measurements::Channel& channel : batch.channels()) {
    const auto& missing = channel.missing();
    if (std::ranges::find(missing, row) == missing.end()) {
      values[channel.name()] = channel.values(row);
    }
  }
  return values;
}

// Returns whether the first row that the session has of the run of the batch's first row is that
// row.
absl::StatusOr<bool> BeginsWithRowOf(Client& client, const StreamSession& session,
                                     const v1::Measurements& batch) {
  bool found = false, same = false;
  v1::ExportSessionRequest request;
  request.set_name(session.name);
  const absl::Status exported =
      client.ExportSession(request, [&](const v1::SessionRecord& piece) -> absl::Status {
        const v1::Measurements& kept = piece.batch().measurements();
        for (int row = 0; row < kept.time_s_size() && !found; ++row) {
          found = RunOf(kept, row) == RunOf(batch, 0);
          same = found && kept.time_s(row) == batch.time_s(0) &&
                 ValuesOf(kept, row) == ValuesOf(batch, 0);
        }
        return found ? absl::CancelledError("the row is found") : absl::OkStatus();
      });
  if (!found) POLYEST_RETURN_IF_ERROR(exported);
  return same;
}

}  // namespace

absl::Status CheckZeroOfTime(Client& client, const StreamSession& session,
                             const v1::Measurements& batch, const std::string& data) {
  if (!session.resumed_after || RunOf(batch, 0) > session.resumed_after->run) {
    return absl::OkStatus();
  }
  POLYEST_ASSIGN_OR_RETURN(const bool same, BeginsWithRowOf(client, session, batch));
  if (same) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat(
      "%s: its times count from its first row, as dates and --time-zero first do, but %s counts "
      "those of run %d from another row; send the record from the run's first row on, of which "
      "rows are skipped that the session has, or write the times in s since that row",
      data, session.name, RunOf(batch, 0)));
}

absl::StatusOr<StreamSession> OpenSession(Client& client, const v1::Problem& problem,
                                          const std::string& id, double reorder_window_s) {
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_problem() = problem;
  create.mutable_session()->set_reorder_window_s(reorder_window_s);
  create.set_session_id(id);
  const auto created = client.CreateSession(create);
  if (created.ok()) return StreamSession{created->name(), std::nullopt};
  if (!absl::IsAlreadyExists(created.status())) return created.status();

  v1::GetSessionRequest get;
  get.set_name(absl::StrCat("sessions/", id));
  POLYEST_ASSIGN_OR_RETURN(const v1::Session session, client.GetSession(get));
  if (!IsProblemOf(session, problem)) {
    return absl::AlreadyExistsError(absl::StrCat("session ", id,
                                                 " already exists with a different problem; resume "
                                                 "it with its own problem or choose another name"));
  }
  POLYEST_RETURN_IF_ERROR(CheckWindow(session, id, reorder_window_s));
  StreamSession resumed{session.name(), std::nullopt};
  if (session.sample_count() > 0) {
    resumed.resumed_after = RowPlace{session.last_run(), session.last_time_s()};
  }
  return resumed;
}

int RemoveRowsUpTo(const RowPlace& place, v1::Measurements& batch) {
  const auto is_there = [&](int row) {
    const int run = batch.run().empty() ? 0 : batch.run(row);
    return run < place.run || (run == place.run && batch.time_s(row) <= place.time_s);
  };
  int rows = 0;
  while (rows < batch.time_s_size() && is_there(rows)) ++rows;
  batch.mutable_time_s()->erase(batch.time_s().begin(), batch.time_s().begin() + rows);
  if (!batch.run().empty()) {
    batch.mutable_run()->erase(batch.run().begin(), batch.run().begin() + rows);
  }
  for (auto& channel : *batch.mutable_channels()) {
    auto& values = *channel.mutable_values();
    values.erase(values.begin(), values.begin() + rows);
    google::protobuf::RepeatedField<int32_t> missing;
    for (const int32_t row : channel.missing()) {
      if (row >= rows) missing.Add(row - rows);
    }
    *channel.mutable_missing() = missing;
  }
  return rows;
}

}  // namespace polyest::internal
