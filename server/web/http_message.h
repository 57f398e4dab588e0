#pragma once

// Describes the requests and the answers of the HTTP port, without the library that parses them.

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace polyest::internal {

// Orders names of headers, in which upper and lower case are the same.
struct HeaderLess {
  bool operator()(const std::string& a, const std::string& b) const;
};

// Is the head of a request; its body is read later, or never.
struct HttpRequest {
  std::string method;
  std::string path;  // decoded, without the query
  std::multimap<std::string, std::string, HeaderLess> headers;
  std::string peer;              // the client's address, "ipv4:192.0.2.7:50123"
  std::string local_host;        // the daemon's address that the client has reached
  std::string certificate_name;  // the common name of the client's certificate; empty: none
  int client = -1;               // the socket, to find out whether the client is still there

  // Returns the value of a header; nothing unless the request has exactly one of that name.
  std::optional<std::string> Header(const std::string& name) const;
};

// Is an answer: a body, or events that are sent one by one.
struct HttpAnswer {
  // Sends bytes; false once the client is gone.
  using Send = std::function<bool(std::string_view)>;

  int status = 200;
  std::string content_type{};
  std::vector<std::pair<std::string, std::string>> headers{};
  std::string body{};
  std::function<void(const Send&)> events{};  // sends all events; null: the answer is the body
};

// Answers requests; used by many threads at once.
class HttpHandler {
 public:
  virtual ~HttpHandler() = default;

  // Looks at the head of a request. Returns the answer to one whose body need not be read; nothing
  // if the request may go on.
  virtual std::optional<HttpAnswer> AnswerHead(const HttpRequest& request) const = 0;
  // Answers a request that has gone on.
  virtual HttpAnswer Answer(const HttpRequest& request, const std::string& body) const = 0;
  // Returns the answer to a request that is not well-formed HTTP, or beyond a limit of its form.
  virtual HttpAnswer Refusal(int status, std::string_view why) const = 0;
  // Notes the answer to a request before it is sent.
  virtual void OnAnswer(int status) const = 0;
  // Ends what requests wait for, which are answered soon then. May be called while others are.
  virtual void Stop() const {}
};

}  // namespace polyest::internal
