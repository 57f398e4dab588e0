#include "server/service/daemon_status.h"

#include "server/telemetry/process_info.h"

namespace polyest {

v1::DaemonStatus DescribeDaemon(const ServiceContext& context, const std::string& tenant) {
  v1::DaemonStatus status;
  status.set_version(Version());
  status.set_durable(context.sessions.services().journal.durable());
  for (const auto& session : context.sessions.All()) {
    if (session->tenant() != tenant) continue;
    status.set_sessions(status.sessions() + 1);
    if (session->loaded()) status.set_sessions_loaded(status.sessions_loaded() + 1);
  }
  status.set_writers(context.calls.Count(OpenCalls::Kind::kWriter));
  status.set_watchers(context.calls.Count(OpenCalls::Kind::kWatcher));
  status.set_waiting_tasks(context.executor.waiting());
  const std::chrono::duration<double> uptime = std::chrono::steady_clock::now() - context.start;
  status.set_uptime(uptime.count());
  status.set_memory_bytes(ResidentMemoryBytes());
  return status;
}

}  // namespace polyest
