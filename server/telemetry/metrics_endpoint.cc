#include "server/telemetry/metrics_endpoint.h"

#include <absl/strings/str_format.h>
#include <prometheus/collectable.h>
#include <prometheus/exposer.h>

#include <exception>
#include <utility>

namespace polyest::internal {
namespace {

constexpr char kThreads[] = "8";
constexpr char kRequestTimeoutMs[] = "1000";
constexpr char kKeepAliveMs[] = "500";

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::Start(const std::string& address,
                                                                        Collectables collectables) {
  // The library reports a port in use by an exception only.
  try {
    // Each connection has a thread for as long as it is open. One whose client says nothing is
    // closed soon, so that scrapes find a thread.
    auto exposer = std::make_unique<prometheus::Exposer>(std::vector<std::string>{
        "listening_ports", address, "num_threads", kThreads, "request_timeout_ms",
        kRequestTimeoutMs, "keep_alive_timeout_ms", kKeepAliveMs});
    return std::unique_ptr<MetricsEndpoint>(
        new MetricsEndpoint(std::move(exposer), std::move(collectables)));
  } catch (const std::exception&) {
    return absl::UnavailableError(absl::StrFormat(
        "--metrics: cannot listen on %s: the port is in use or the address is not this machine's",
        address));
  }
}

MetricsEndpoint::MetricsEndpoint(std::unique_ptr<prometheus::Exposer> exposer,
                                 Collectables collectables)
    : collectables_(std::move(collectables)), exposer_(std::move(exposer)) {
  for (const auto& collectable : collectables_) exposer_->RegisterCollectable(collectable);
  port_ = exposer_->GetListeningPorts().front();
}

MetricsEndpoint::~MetricsEndpoint() = default;

}  // namespace polyest::internal
