#include "client/cli/top_table.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "client/cli/number_format.h"
#include "client/cli/screen.h"
#include "client/cli/text_table.h"

namespace polyest::internal {
namespace {

constexpr char kUnknown[] = "-";
// Three lines of the header, the header of the table, the number of sessions left out, and the last
// line.
constexpr int kRowsBesidesSessions = 6;

std::string YesOrUnknown(bool yes) { return yes ? "yes" : kUnknown; }

// Two lines that fit into 80 columns for any daemon with fewer than 10,000 sessions.
void PrintHeader(const v1::DaemonStatus& status, std::ostream& out) {
  const std::string stored = FormatBytes(status.stored_bytes());
  out << absl::StrFormat(
      "polyestd %s, up %s, %s of memory, %s\n", status.version(), FormatDuration(status.uptime_s()),
      FormatBytes(status.memory_bytes()),
      status.durable() ? absl::StrCat("sessions on disk: ", stored) : "sessions in memory only");
  out << absl::StrFormat("%d sessions, %d loaded, %d writers, %d watchers, %d tasks waiting\n\n",
                         status.session_count(), status.loaded_session_count(),
                         status.writer_count(), status.watcher_count(),
                         status.waiting_task_count());
}

const v1::Session* Find(const DaemonView& view, const std::string& name) {
  for (const v1::Session& session : view.sessions) {
    if (session.name() == name) return &session;
  }
  return nullptr;
}

std::string SampleRate(const v1::Session& session, const DaemonView& now,
                       const DaemonView* before) {
  if (before == nullptr || now.time_s <= before->time_s) return kUnknown;
  const v1::Session* const earlier = Find(*before, session.name());
  // If the number has decreased, the earlier session was another one of the same name.
  if (earlier == nullptr || earlier->sample_count() > session.sample_count()) return kUnknown;
  const auto samples = static_cast<double>(session.sample_count() - earlier->sample_count());
  return FormatNumber(samples / (now.time_s - before->time_s), 3);
}

struct Column {
  const char* title;
  int importance;  // the least important is left out first
  std::function<std::string(const v1::Session&)> cell;
};

// Returns the columns from left to right.
std::vector<Column> Columns(const DaemonView& now, const DaemonView* before) {
  using Session = v1::Session;
  return {
      {"session", 12,
       [](const Session& s) { return std::string(absl::StripPrefix(s.name(), "sessions/")); }},
      {"batches", 5, [](const Session& s) { return absl::StrCat(s.activity().batch_count()); }},
      {"samples", 9, [](const Session& s) { return absl::StrCat(s.sample_count()); }},
      {"samples/s", 10, [&now, before](const Session& s) { return SampleRate(s, now, before); }},
      {"estimates", 2,
       [](const Session& s) { return absl::StrCat(s.activity().estimate_count()); }},
      {"re-expansions", 1,
       [](const Session& s) { return absl::StrCat(s.activity().reexpansion_count()); }},
      {"real-time", 11,
       [](const Session& s) {
         const double factor = s.activity().real_time_factor();
         return factor > 0 ? FormatNumber(factor, 3) : kUnknown;
       }},
      {"unprocessed", 8,
       [](const Session& s) {
         return s.activity().loaded() ? absl::StrCat(s.activity().unprocessed_batch_count())
                                      : kUnknown;
       }},
      {"writer", 6, [](const Session& s) { return YesOrUnknown(s.activity().has_writer()); }},
      {"watchers", 4, [](const Session& s) { return absl::StrCat(s.activity().watcher_count()); }},
      {"loaded", 3, [](const Session& s) { return YesOrUnknown(s.activity().loaded()); }},
      {"idle", 7, [](const Session& s) { return FormatDuration(s.activity().idle_time_s()); }},
  };
}

// Returns a table of the first `sessions` sessions. Names longer than a third of the screen are
// cut.
TextTable MakeTable(const DaemonView& now, const std::vector<Column>& columns, size_t sessions,
                    int screen_columns) {
  std::vector<std::string> cells;
  for (const Column& column : columns) cells.emplace_back(column.title);
  TextTable table(std::move(cells));
  for (size_t i = 0; i < sessions; ++i) {
    cells.clear();
    for (const Column& column : columns) cells.push_back(column.cell(now.sessions[i]));
    // Session names are ASCII.
    const size_t limit = screen_columns > 0 ? static_cast<size_t>(screen_columns) / 3 : 0;
    if (limit > 0 && cells[0].size() > limit) cells[0] = cells[0].substr(0, limit - 1) + "…";
    table.AddRow(std::move(cells));
  }
  return table;
}

}  // namespace

std::string FormatDuration(double seconds) {
  if (seconds < 60) return absl::StrFormat("%.0f s", seconds);
  if (seconds < 3600) return absl::StrFormat("%.0f min", seconds / 60);
  if (seconds < 86'400) return absl::StrFormat("%.1f h", seconds / 3600);
  return absl::StrFormat("%.1f d", seconds / 86'400);
}

std::string FormatBytes(int64_t bytes) {
  if (bytes < 1024) return absl::StrCat(bytes, " B");
  auto value = static_cast<double>(bytes);
  const char* unit = "B";
  for (const char* larger : {"KiB", "MiB", "GiB", "TiB"}) {
    if (value < 1024) break;
    value /= 1024;
    unit = larger;
  }
  return absl::StrFormat("%.1f %s", value, unit);
}

void PrintTop(const DaemonView& now, const DaemonView* before, bool fit_rows, std::ostream& out) {
  const Screen screen = GetScreen(out);
  PrintHeader(now.status, out);
  const size_t sessions = now.sessions.size();
  size_t shown = sessions;
  if (fit_rows && screen.rows > 0) {
    shown = std::min(shown, static_cast<size_t>(std::max(1, screen.rows - kRowsBesidesSessions)));
  }
  std::vector<Column> columns = Columns(now, before);
  TextTable table = MakeTable(now, columns, shown, screen.columns);
  while (screen.columns > 0 && table.Width() > screen.columns && columns.size() > 1) {
    columns.erase(std::min_element(
        columns.begin(), columns.end(),
        [](const Column& a, const Column& b) { return a.importance < b.importance; }));
    table = MakeTable(now, columns, shown, screen.columns);
  }
  table.Print(out);
  if (shown < sessions) out << "… and " << sessions - shown << " more\n";
  if (fit_rows) out << Paint(out, Color::kFaint, "press q to quit");
}

}  // namespace polyest::internal
