#pragma once

// Serves the metrics over plain HTTP at /metrics, for Prometheus to scrape.

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <vector>

namespace prometheus {
class Collectable;
class Exposer;
}  // namespace prometheus

namespace polyest::internal {

class MetricsEndpoint {
 public:
  using Collectables = std::vector<std::shared_ptr<prometheus::Collectable>>;

  // Starts to serve. `address` is HOST:PORT with a numeric HOST; port 0 picks a free one.
  // UNAVAILABLE when it cannot be listened on.
  static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> Start(const std::string& address,
                                                                Collectables collectables);
  // Waits for scrapes under way.
  ~MetricsEndpoint();

  int port() const { return port_; }

 private:
  MetricsEndpoint(std::unique_ptr<prometheus::Exposer> exposer, Collectables collectables);

  const Collectables collectables_;
  std::unique_ptr<prometheus::Exposer> exposer_;
  int port_ = 0;
};

}  // namespace polyest::internal
