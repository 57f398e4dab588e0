#pragma once

// One connection to a server over HTTP, kept open between requests.

#include <memory>
#include <string>

namespace polyest::internal {

// How a request ended.
struct HttpReply {
  enum class Kind {
    kAnswered,     // `status` and `text` are the answer's
    kTimedOut,     // the server has not answered in time
    kLost,         // the connection broke before the answer was complete
    kUnreachable,  // there was no connection, so that the server knows nothing of the request
  };
  Kind kind = Kind::kUnreachable;
  int status = 0;    // of HTTP
  std::string text;  // the answer's body, or what went wrong
};

class Connection {
 public:
  // `url` is "http://HOST:PORT" or "https://HOST:PORT". `timeout_s` bounds the wait for an answer.
  // Connects at the first request.
  Connection(const std::string& url, double timeout_s);
  ~Connection();

  // Sends JSON to a path such as "/Evaluate" and waits for the answer.
  HttpReply Post(const std::string& path, const std::string& json);
  // Ends a request that another thread waits for: it ends as kLost or kUnreachable.
  void Abort();

 private:
  struct Client;
  double timeout_s_;
  std::unique_ptr<Client> client_;
};

}  // namespace polyest::internal
