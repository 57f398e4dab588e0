#pragma once

// Serves the sessions of a caller as models of the UM-Bridge protocol 1.0: functions of the
// uncertain parameters with the two outputs log posterior and log likelihood, and their
// derivatives. Every request becomes a call of the daemon's gRPC server, as in gateway.h.

#include <grpcpp/channel.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "polyest/v1/study_service.pb.h"
#include "server/security/caller.h"
#include "server/web/host_check.h"
#include "server/web/http_message.h"

namespace polyest::internal {

class UmBridgeGateway final : public HttpHandler {
 public:
  struct Options {
    // Returns who asks, if the daemon knows. The bodies of others are not read.
    std::function<std::optional<Caller>(const HttpRequest&)> who = [](const HttpRequest&) {
      return Caller();
    };
    // Counts an answer by its status.
    std::function<void(int)> count = [](int) {};
  };

  // `channel` leads into the daemon's own server.
  UmBridgeGateway(std::shared_ptr<grpc::Channel> channel, HostCheck hosts, Options options)
      : channel_(std::move(channel)), hosts_(std::move(hosts)), options_(std::move(options)) {}

  std::optional<HttpAnswer> AnswerHead(const HttpRequest& request) const override;
  HttpAnswer Answer(const HttpRequest& request, const std::string& body) const override;
  HttpAnswer Refusal(int status, std::string_view why) const override;
  void OnAnswer(int status) const override { options_.count(status); }

 private:
  // Calls a method; its error becomes the protocol's. Returns nothing once `response` is set.
  template <typename Request, typename Response>
  std::optional<HttpAnswer> Call(const std::string& method, const Request& message,
                                 const HttpRequest& request, Response& response) const;
  HttpAnswer AnswerInfo(const HttpRequest& request) const;
  HttpAnswer AnswerModel(const HttpRequest& request, const std::string& body) const;

  const std::shared_ptr<grpc::Channel> channel_;
  const HostCheck hosts_;
  const Options options_;
};

}  // namespace polyest::internal
