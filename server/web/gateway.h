#pragma once

// Serves the methods of the daemon's services as JSON over HTTP, and the live page. Every call goes
// through the daemon's gRPC server, so that callers, roles, limits, logs and errors are the same.
// Clients that ask for the same watch share one call (shared_watch.h).

#include <grpcpp/channel.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "polyest/v1/session_service.pb.h"
#include "server/security/caller.h"
#include "server/telemetry/log_limit.h"
#include "server/web/event_source.h"
#include "server/web/host_check.h"
#include "server/web/http_message.h"
#include "server/web/method_table.h"
#include "server/web/shared_watch.h"
#include "server/web/turns.h"
#include "server/web/web_call.h"
#include "server/web/web_page.h"

namespace polyest::internal {

class Gateway final : public HttpHandler {
 public:
  struct Options {
    // Largest message; its JSON may be longer.
    size_t message_bytes = size_t{64} << 20;
    // Number of streams of events at a time; less than there are connections, so that there is
    // always room for other calls.
    int streams = 320;
    // Time after which a stream without messages shows that it lives.
    std::chrono::milliseconds alive{10'000};
    std::span<const WebFile> files = EmbeddedFiles();
    // Returns who asks, if the daemon knows. The bodies of others are not read.
    std::function<std::optional<Caller>(const HttpRequest&)> who = [](const HttpRequest&) {
      return Caller();
    };
    // Counts an answer by its status.
    std::function<void(int)> count = [](int) {};
  };

  // `channel` leads into the daemon's own server.
  Gateway(std::shared_ptr<grpc::Channel> channel, MethodTable methods, HostCheck hosts,
          Options options);

  std::optional<HttpAnswer> AnswerHead(const HttpRequest& request) const override;
  HttpAnswer Answer(const HttpRequest& request, const std::string& body) const override;
  HttpAnswer Refusal(int status, std::string_view why) const override;
  void OnAnswer(int status) const override { options_.count(status); }
  void Stop() const override { large_requests_.Stop(); }

 private:
  // A place among the streams, which is given back when its last owner goes.
  using Place = std::shared_ptr<const Gateway>;

  // Logs a request that does not become a call, which is logged by itself.
  void LogRefusal(const HttpRequest& request, const absl::Status& refusal) const;
  HttpAnswer AnswerCall(const WebMethod& method, const HttpRequest& request,
                        const std::string& body) const;
  // Reads the JSON of a request into the message of its call; a refusal if that fails. Large ones
  // take turns, so that they occupy neither all cores nor much memory at once.
  std::optional<HttpAnswer> Read(const WebMethod& method, const HttpRequest& request,
                                 const std::string& body, std::string& message) const;
  HttpAnswer AnswerOnce(WebCall& call, const WebMethod& method, const HttpRequest& request) const;
  // Begins a stream of events, be it of a call of its own or of a watch that others have begun.
  std::shared_ptr<EventSource> Begin(const WebMethod& method, const HttpRequest& request,
                                     const WebCall::Request& call) const;
  // Returns the watched session as the caller sees it; nothing if there is none.
  std::optional<v1::Session> SessionOf(const HttpRequest& request,
                                       const WebCall::Request& watch) const;
  HttpAnswer AnswerEvents(std::shared_ptr<EventSource> source, const HttpRequest& request,
                          Place place) const;
  void SendEvents(EventSource& source, WebCall::Event event, int client,
                  const HttpAnswer::Send& send) const;
  // Returns a place; null if all are taken.
  Place TakePlace() const;

  const std::shared_ptr<grpc::Channel> channel_;
  const MethodTable methods_;
  const HostCheck hosts_;
  const Options options_;
  mutable std::atomic<int> streams_ = 0;
  mutable SharedWatches watches_;
  mutable Turns large_requests_;
  mutable LogLimit refusals_{/*burst=*/50, /*a_second=*/5};
};

}  // namespace polyest::internal
