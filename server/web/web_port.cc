#include "server/web/web_port.h"

#include <utility>

#include "core/common/status.h"
#include "server/security/method_roles.h"
#include "server/web/gateway.h"
#include "server/web/tls_context.h"
#include "server/web/umbridge_gateway.h"

namespace polyest::internal {

absl::StatusOr<std::unique_ptr<WebPort>> WebPort::Open(const Options& options) {
  WebServer::Options server{
      .option = options.protocol == Protocol::kUmBridge ? "--umbridge" : "--web",
      .host = options.host,
      .port = options.port,
      .body_memory_bytes = options.body_memory_bytes};
  server.http.body_bytes = static_cast<size_t>(options.max_message_mb) << 20;
  POLYEST_ASSIGN_OR_RETURN(auto opened, WebServer::Open(server));
  std::unique_ptr<WebPort> port(new WebPort(options, std::move(opened)));
  POLYEST_RETURN_IF_ERROR(port->ReloadTls());
  return port;
}

std::unique_ptr<HttpHandler> WebPort::MakeHandler(std::shared_ptr<grpc::Channel> channel) const {
  const auto who = [this](const HttpRequest& request) {
    std::optional<std::string> certificate;
    if (!request.certificate_name.empty()) certificate = request.certificate_name;
    return options_.who(request.Header("Authorization"), std::move(certificate));
  };
  HostCheck hosts(options_.host, options_.names);
  if (options_.protocol == Protocol::kUmBridge) {
    return std::make_unique<UmBridgeGateway>(
        std::move(channel), std::move(hosts),
        UmBridgeGateway::Options{.who = who, .count = options_.count});
  }
  Gateway::Options gateway{.message_bytes = static_cast<size_t>(options_.max_message_mb) << 20,
                           .count = options_.count};
  gateway.who = who;
  return std::make_unique<Gateway>(std::move(channel), MethodTable(Services()), std::move(hosts),
                                   std::move(gateway));
}

void WebPort::Serve(std::shared_ptr<grpc::Channel> channel) {
  handler_ = MakeHandler(std::move(channel));
  server_->Serve(*handler_);
}

absl::Status WebPort::ReloadTls() {
  if (options_.tls.certificate.empty()) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(const TlsMaterial material, ReadTlsMaterial(options_.tls));
  POLYEST_ASSIGN_OR_RETURN(auto context, MakeTlsContext(material));
  server_->UseTls(std::move(context));
  return absl::OkStatus();
}

}  // namespace polyest::internal
