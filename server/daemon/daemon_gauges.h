#pragma once

// Tells Prometheus the present state of the daemon, and how many connections its listener has
// refused; both are looked up at each scrape.

#include <prometheus/collectable.h>

#include <atomic>
#include <string>
#include <vector>

#include "server/daemon/listener.h"
#include "server/execution/executor.h"
#include "server/service/open_calls.h"
#include "server/sessions/session_registry.h"

namespace polyest::internal {

class DaemonGauges final : public prometheus::Collectable {
 public:
  // Refers to objects that must outlive it. `data_dir` is the journal's folder; empty when the
  // journal is not on disk.
  DaemonGauges(const SessionRegistry& sessions, const Executor& executor, const OpenCalls& calls,
               std::string data_dir, const std::atomic<bool>& ready, Listener& listener)
      : sessions_(sessions),
        executor_(executor),
        calls_(calls),
        data_dir_(std::move(data_dir)),
        ready_(ready),
        listener_(listener) {}

  std::vector<prometheus::MetricFamily> Collect() const override;

 private:
  void CollectSessions(std::vector<prometheus::MetricFamily>& families) const;
  void CollectDisk(std::vector<prometheus::MetricFamily>& families) const;

  const SessionRegistry& sessions_;
  const Executor& executor_;
  const OpenCalls& calls_;
  const std::string data_dir_;
  const std::atomic<bool>& ready_;
  Listener& listener_;
};

}  // namespace polyest::internal
