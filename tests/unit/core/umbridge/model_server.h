#pragma once

// A server of UM-Bridge models in this process, which fails as it is told.

#include <httplib.h>

#include <atomic>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>

namespace polyest::internal {

class ModelServer {
 public:
  using Json = nlohmann::json;
  // Answers a request for /Evaluate.
  using Handler = std::function<void(const Json& request, httplib::Response& answer)>;

  // Begins to listen on a free port of the loopback.
  explicit ModelServer(Handler handler) : handler_(std::move(handler)) {
    http_.Post("/Evaluate", [this](const httplib::Request& request, httplib::Response& answer) {
      ++requests_;
      handler_(Json::parse(request.body), answer);
    });
    http_.set_tcp_nodelay(true);
    port_ = http_.bind_to_any_port("127.0.0.1");
    thread_ = std::thread([this] { http_.listen_after_bind(); });
    while (!http_.is_running()) std::this_thread::yield();
  }
  ~ModelServer() {
    http_.stop();
    thread_.join();
  }

  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_); }
  int requests() const { return requests_; }

  static void Answer(const Json& output, httplib::Response& answer) {
    answer.set_content(Json{{"output", output}}.dump(), "application/json");
  }
  static void Refuse(const std::string& message, httplib::Response& answer) {
    answer.status = 400;
    answer.set_content(Json{{"error", {{"type", "InvalidInput"}, {"message", message}}}}.dump(),
                       "application/json");
  }

 private:
  Handler handler_;
  httplib::Server http_;
  int port_ = 0;
  std::atomic<int> requests_ = 0;
  std::thread thread_;
};

}  // namespace polyest::internal
