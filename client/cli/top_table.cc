#include "client/cli/top_table.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/strip.h>

#include "client/cli/number_format.h"
#include "client/cli/text_table.h"

namespace polyest {
namespace {

constexpr char kUnknown[] = "-";

void PrintHeader(const v1::DaemonStatus& status, std::ostream& out) {
  out << absl::StrFormat("polyestd %s, up %s, %s, %s\n", status.version(),
                         FormatDuration(status.uptime()), FormatBytes(status.memory_bytes()),
                         status.durable() ? "sessions on disk" : "sessions in memory only");
  out << absl::StrFormat(
      "%d sessions, %d of them loaded; %d writers, %d watchers, %d tasks waiting\n\n",
      status.sessions(), status.sessions_loaded(), status.writers(), status.watchers(),
      status.waiting_tasks());
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
  // A smaller number is of another session that had the name.
  if (earlier == nullptr || earlier->samples() > session.samples()) return kUnknown;
  const auto samples = static_cast<double>(session.samples() - earlier->samples());
  return FormatNumber(samples / (now.time_s - before->time_s), 3);
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

void PrintTop(const DaemonView& now, const DaemonView* before, std::ostream& out) {
  PrintHeader(now.status, out);
  TextTable table({"session", "batches", "samples", "samples/s", "estimates", "re-expansions",
                   "real-time", "unprocessed", "writer", "watchers", "loaded", "idle"});
  for (const v1::Session& session : now.sessions) {
    const v1::Session::Activity& activity = session.activity();
    const double factor = activity.real_time_factor();
    table.AddRow({std::string(absl::StripPrefix(session.name(), "sessions/")),
                  absl::StrCat(activity.batches()), absl::StrCat(session.samples()),
                  SampleRate(session, now, before), absl::StrCat(activity.estimates()),
                  absl::StrCat(activity.reexpansions()),
                  factor > 0 ? FormatNumber(factor, 3) : kUnknown,
                  activity.loaded() ? absl::StrCat(activity.unprocessed_batches()) : kUnknown,
                  activity.has_writer() ? "yes" : kUnknown, absl::StrCat(activity.watchers()),
                  activity.loaded() ? "yes" : kUnknown, FormatDuration(activity.idle_time())});
  }
  table.Print(out);
}

}  // namespace polyest
