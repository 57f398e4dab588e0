#include "server/service/daemon_status.h"

#include "server/telemetry/process_info.h"

namespace polyest::internal {

v1::DaemonStatus DescribeDaemon(const ServiceContext& context, const std::string& tenant) {
  v1::DaemonStatus status;
  status.set_version(Version());
  status.set_durable(context.sessions.services().journal.durable());
  for (const auto& session : context.sessions.All()) {
    if (session->tenant() != tenant) continue;
    status.set_session_count(status.session_count() + 1);
    if (session->loaded()) status.set_loaded_session_count(status.loaded_session_count() + 1);
  }
  status.set_writer_count(context.calls.Count(OpenCalls::Kind::kWriter));
  status.set_watcher_count(context.calls.Count(OpenCalls::Kind::kWatcher));
  status.set_waiting_task_count(context.executor.waiting());
  const std::chrono::duration<double> uptime = std::chrono::steady_clock::now() - context.start;
  status.set_uptime_s(uptime.count());
  status.set_memory_bytes(ResidentMemoryBytes());
  const SessionServices& sessions = context.sessions.services();
  status.set_stored_bytes(sessions.stored->OfTenant(tenant).bytes);
  status.set_max_stored_bytes(sessions.limits.disk_mb_per_tenant << 20);
  return status;
}

}  // namespace polyest::internal
