#include "client/cli/stream_session.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/util/message_differencer.h>

#include "core/common/status.h"

namespace polyest::internal {

absl::StatusOr<StreamSession> OpenSession(Client& client, const v1::Problem& problem,
                                          const std::string& id) {
  v1::CreateSessionRequest create;
  *create.mutable_session()->mutable_problem() = problem;
  create.set_session_id(id);
  const auto created = client.CreateSession(create);
  if (created.ok()) return StreamSession{created->name(), std::nullopt};
  if (!absl::IsAlreadyExists(created.status())) return created.status();

  v1::GetSessionRequest get;
  get.set_name(absl::StrCat("sessions/", id));
  POLYEST_ASSIGN_OR_RETURN(const v1::Session session, client.GetSession(get));
  if (!google::protobuf::util::MessageDifferencer::Equals(session.problem(), problem)) {
    return absl::AlreadyExistsError(absl::StrCat("session ", id,
                                                 " already exists with a different problem; resume "
                                                 "it with its own problem or choose another name"));
  }
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
