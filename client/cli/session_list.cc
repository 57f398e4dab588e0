#include "client/cli/session_list.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <google/protobuf/util/time_util.h>

#include "client/cli/number_format.h"
#include "client/cli/text_table.h"
#include "client/cli/top_table.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Returns "streaming" if data are coming in; otherwise whether the session is in memory or stored.
std::string State(const v1::Session::Activity& activity) {
  if (activity.has_writer()) return "streaming";
  return activity.loaded() ? "in memory" : "stored";
}

// Returns the time of creation as "2026-11-22 07:15:02Z".
std::string CreateTime(const v1::Session& session) {
  google::protobuf::Timestamp whole_seconds;
  whole_seconds.set_seconds(session.create_time().seconds());
  std::string text = google::protobuf::util::TimeUtil::ToString(whole_seconds);
  const size_t separator = text.find('T');
  if (separator != std::string::npos) text[separator] = ' ';
  return text;
}

}  // namespace

absl::StatusOr<v1::ListSessionsResponse> ListAllSessions(Client& client) {
  v1::ListSessionsResponse all;
  v1::ListSessionsRequest request;
  do {
    POLYEST_ASSIGN_OR_RETURN(v1::ListSessionsResponse page, client.ListSessions(request));
    all.mutable_sessions()->MergeFrom(page.sessions());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return all;
}

void PrintSessions(const v1::ListSessionsResponse& list, std::ostream& out) {
  TextTable table({"session", "batches", "samples", "t (s)", "run", "state", "idle", "created"});
  for (const v1::Session& session : list.sessions()) {
    const bool any = session.sample_count() > 0;
    table.AddRow({std::string(absl::StripPrefix(session.name(), "sessions/")),
                  absl::StrCat(session.last_sequence()), absl::StrCat(session.sample_count()),
                  any ? FormatNumber(session.last_time_s(), 6) : "-",
                  any ? absl::StrCat(session.last_run()) : "-", State(session.activity()),
                  FormatDuration(session.activity().idle_time_s()), CreateTime(session)});
  }
  table.Print(out);
}

}  // namespace polyest::internal
