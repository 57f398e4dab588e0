#include "server/daemon/daemon_gauges.h"

#include <prometheus/metric_family.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "server/telemetry/process_info.h"

namespace polyest::internal {
namespace {

using Families = std::vector<prometheus::MetricFamily>;

prometheus::ClientMetric& AddFamily(Families& families, const char* name, const char* help,
                                    prometheus::MetricType type) {
  prometheus::MetricFamily& family = families.emplace_back();
  family.name = name;
  family.help = help;
  family.type = type;
  return family.metric.emplace_back();
}

void Add(Families& families, const char* name, const char* help, double value) {
  AddFamily(families, name, help, prometheus::MetricType::Gauge).gauge.value = value;
}

// Adds a number that only rises; by custom its name ends in "_total".
void AddCounter(Families& families, const char* name, const char* help, double value) {
  AddFamily(families, name, help, prometheus::MetricType::Counter).counter.value = value;
}

// Returns the size of a file in bytes; 0 when there is no such file.
double FileBytes(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  return error ? 0 : static_cast<double>(size);
}

}  // namespace

std::vector<prometheus::MetricFamily> DaemonGauges::Collect() const {
  Families families;
  Add(families, "polyest_ready", "Whether the daemon is ready, as its health service says.",
      ready_ ? 1 : 0);
  CollectSessions(families);
  Add(families, "polyest_writers", "Open streams of measurements.",
      calls_.Count(OpenCalls::Kind::kWriter));
  Add(families, "polyest_watchers", "Open watches of sessions.",
      calls_.Count(OpenCalls::Kind::kWatcher));
  Add(families, "polyest_waiting_tasks", "Tasks that wait for a thread of the numerics.",
      executor_.waiting());
  Add(families, "process_resident_memory_bytes", "Resident memory of the process.",
      static_cast<double>(ResidentMemoryBytes()));
  Add(families, "polyest_connections", "Open connections of clients.",
      static_cast<double>(listener_.open()));
  AddCounter(families, "polyest_refused_connections_total",
             "Connections refused since the start, because too many were open.",
             static_cast<double>(listener_.refused()));
  Add(families, "process_open_fds", "Descriptors that the process has open.",
      static_cast<double>(OpenDescriptors()));
  if (!data_dir_.empty()) CollectDisk(families);
  return families;
}

void DaemonGauges::CollectSessions(Families& families) const {
  int sessions = 0;
  int loaded = 0;
  int behind = 0;
  int64_t waiting = 0;
  int64_t rows = 0;
  int64_t unprocessed = 0;
  for (const auto& session : sessions_.All()) {
    const v1::Session described = session->Describe();
    const v1::Session::Activity& activity = described.activity();
    ++sessions;
    if (activity.loaded()) ++loaded;
    rows += session->place().rows;
    // A factor of 0 says that nothing has been measured yet.
    const double factor = activity.real_time_factor();
    if (activity.has_writer() && factor > 0 && factor < 1) ++behind;
    unprocessed += activity.unprocessed_batch_count();
    waiting += std::max<int64_t>(0, session->taken().sequence - described.last_sequence());
  }
  Add(families, "polyest_sessions", "Sessions of all tenants.", sessions);
  Add(families, "polyest_sessions_loaded", "Sessions whose estimator is in memory.", loaded);
  Add(families, "polyest_stored_rows", "Rows of all sessions of all tenants.",
      static_cast<double>(rows));
  Add(families, "polyest_stored_bytes",
      "Bytes of the problems, measurements and snapshots of all tenants.",
      static_cast<double>(sessions_.services().stored->InAll().bytes));
  Add(families, "polyest_sessions_behind_real_time",
      "Sessions with an open stream whose real-time factor is below 1.", behind);
  Add(families, "polyest_journal_waiting_batches", "Batches taken and not yet kept.",
      static_cast<double>(waiting));
  Add(families, "polyest_unprocessed_batches",
      "Batches of loaded sessions that wait for the numerics.", static_cast<double>(unprocessed));
}

void DaemonGauges::CollectDisk(Families& families) const {
  const std::filesystem::path file = std::filesystem::path(data_dir_) / "journal.db";
  Add(families, "polyest_journal_file_bytes", "Size of the journal's file.", FileBytes(file));
  Add(families, "polyest_journal_log_bytes", "Size of the journal's write-ahead log.",
      FileBytes(file.string() + "-wal"));
  std::error_code error;
  const auto space = std::filesystem::space(data_dir_, error);
  if (error) return;
  Add(families, "polyest_disk_free_bytes", "Free space on the disk of the data folder.",
      static_cast<double>(space.available));
}

}  // namespace polyest::internal
