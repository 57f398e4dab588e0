#include "server/web/web_port.h"

#include <utility>

#include "core/common/status.h"
#include "server/security/method_roles.h"
#include "server/web/tls_context.h"

namespace polyest::internal {

absl::StatusOr<std::unique_ptr<WebPort>> WebPort::Open(const Options& options) {
  WebServer::Options server{
      .host = options.host, .port = options.port, .body_memory_bytes = options.body_memory_bytes};
  server.http.body_bytes = static_cast<size_t>(options.max_message_mb) << 20;
  POLYEST_ASSIGN_OR_RETURN(auto opened, WebServer::Open(server));
  std::unique_ptr<WebPort> port(new WebPort(options, std::move(opened)));
  POLYEST_RETURN_IF_ERROR(port->ReloadTls());
  return port;
}

void WebPort::Serve(std::shared_ptr<grpc::Channel> channel) {
  Gateway::Options gateway{.message_bytes = static_cast<size_t>(options_.max_message_mb) << 20,
                           .count = options_.count};
  gateway.knows = [this](const HttpRequest& request) {
    std::optional<std::string> certificate;
    if (!request.certificate_name.empty()) certificate = request.certificate_name;
    return options_.knows(request.Header("Authorization"), std::move(certificate));
  };
  gateway_ =
      std::make_unique<Gateway>(std::move(channel), MethodTable(Services()),
                                HostCheck(options_.host, options_.names), std::move(gateway));
  server_->Serve(*gateway_);
}

absl::Status WebPort::ReloadTls() {
  if (options_.tls.certificate.empty()) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(const TlsMaterial material, ReadTlsMaterial(options_.tls));
  POLYEST_ASSIGN_OR_RETURN(auto context, MakeTlsContext(material));
  server_->UseTls(std::move(context));
  return absl::OkStatus();
}

}  // namespace polyest::internal
