#include "core/umbridge/connection.h"

#include <absl/strings/str_format.h>
#include <httplib.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

namespace polyest::internal {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kConnectWithin(5);

// Whether the connection broke before the end of an answer. An answer without a length ends with
// its connection, so that only its JSON tells. Errors are texts of any kind.
bool BrokeOff(const httplib::Response& answer) {
  const bool has_length =
      answer.has_header("Content-Length") || answer.has_header("Transfer-Encoding");
  return answer.status == 200 && !has_length && !nlohmann::json::accept(answer.body);
}

}  // namespace

struct Connection::Client {
  explicit Client(const std::string& url) : http(url) {}
  httplib::Client http;
};

Connection::Connection(const std::string& url, double timeout_s)
    : timeout_s_(timeout_s), client_(std::make_unique<Client>(url)) {
  httplib::Client& http = client_->http;
  const auto timeout = std::chrono::duration_cast<std::chrono::microseconds>(
      std::chrono::duration<double>(timeout_s));
  http.set_connection_timeout(kConnectWithin);
  http.set_read_timeout(timeout);
  http.set_write_timeout(timeout);
  http.set_keep_alive(true);
  http.set_tcp_nodelay(true);
}

Connection::~Connection() = default;

HttpReply Connection::Post(const std::string& path, const std::string& json) {
  const Clock::time_point begin = Clock::now();
  httplib::Result result = client_->http.Post(path.c_str(), json, "application/json");
  const HttpReply lost{HttpReply::Kind::kLost, 0, "the connection was lost"};
  if (result) {
    if (BrokeOff(*result)) return lost;
    return {HttpReply::Kind::kAnswered, result->status, std::move(result->body)};
  }
  const std::string reason = httplib::to_string(result.error());
  switch (result.error()) {
    case httplib::Error::Read:
    case httplib::Error::Write:
      // The library does not tell a time-out from a broken connection.
      if (std::chrono::duration<double>(Clock::now() - begin).count() >= timeout_s_) {
        return {HttpReply::Kind::kTimedOut, 0,
                absl::StrFormat("no answer within %g s", timeout_s_)};
      }
      return lost;
    default:
      return {HttpReply::Kind::kUnreachable, 0, "no connection (" + reason + ")"};
  }
}

void Connection::Abort() { client_->http.stop(); }

}  // namespace polyest::internal
