#pragma once

// The fixture of the tests of the HTTP port: a daemon that serves it beside gRPC, and its clients.

#include <google/protobuf/struct.pb.h>
#include <httplib.h>

#include <memory>
#include <utility>

#include "proto/wire/json/json_format.h"
#include "tests/integration/daemon_fixture.h"

namespace polyest::internal {

// The answer to one request; status 0 if none came.
struct WebAnswer {
  int status = 0;
  httplib::Headers headers{};
  std::string body{};

  std::string Header(const std::string& name) const {
    const auto found = headers.find(name);
    return found == headers.end() ? "" : found->second;
  }
  // Returns the body as an object; an error of it has the members code, message and details.
  google::protobuf::Struct Json() const {
    google::protobuf::Struct object;
    EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(body, &object).ok()) << body;
    return object;
  }
  int Code() const { return static_cast<int>(Json().fields().at("code").number_value()); }
  std::string Message() const { return Json().fields().at("message").string_value(); }
};

// One event of a stream; without a name it is a message.
struct WebEvent {
  std::string name;
  std::string data;
};

// Takes bytes of a stream and returns the events in them. Comments are left out.
class EventParser {
 public:
  std::vector<WebEvent> Take(const std::string& bytes) {
    text_ += bytes;
    std::vector<WebEvent> events;
    for (size_t end = text_.find("\n\n"); end != std::string::npos; end = text_.find("\n\n")) {
      WebEvent event;
      std::istringstream lines(text_.substr(0, end));
      for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("event: ")) event.name = line.substr(7);
        if (line.starts_with("data: ")) event.data = line.substr(6);
      }
      text_.erase(0, end + 2);
      if (!event.data.empty()) events.push_back(event);
    }
    return events;
  }

 private:
  std::string text_;
};

// A client of the HTTP port at HOST:PORT.
class WebClientOfTest {
 public:
  // Reads "web page on http://HOST:PORT/".
  explicit WebClientOfTest(const std::string& line)
      : address_(line.substr(std::string("web page on ").size())) {
    EXPECT_TRUE(line.starts_with("web page on http") && line.ends_with('/')) << line;
    if (!address_.empty()) address_.pop_back();
    client_ = std::make_unique<httplib::Client>(address_);
    client_->set_keep_alive(true);
    client_->set_tcp_nodelay(true);
    client_->set_read_timeout(60);
  }

  const std::string& address() const { return address_; }
  std::string authority() const { return address_.substr(address_.find("//") + 2); }
  int port() const { return std::stoi(address_.substr(address_.rfind(':') + 1)); }
  httplib::Client& client() { return *client_; }

  WebAnswer Get(const std::string& path, const httplib::Headers& headers = {}) {
    return ToAnswer(client_->Get(path, headers));
  }
  // Calls a method, "SessionService/GetSession".
  WebAnswer Post(const std::string& method, const std::string& json,
                 const httplib::Headers& headers = {}) {
    return ToAnswer(client_->Post("/v1/" + method, headers, json, "application/json"));
  }
  // Calls a method whose answer is a stream, and gives each event to `take` until that returns
  // false. Returns the head of the answer, with the body of an error.
  WebAnswer Stream(const std::string& method, const std::string& json,
                   const std::function<bool(const WebEvent&)>& take,
                   const httplib::Headers& headers = {}) {
    httplib::Request request;
    request.method = "POST";
    request.path = "/v1/" + method;
    request.headers = headers;
    request.headers.emplace("Content-Type", "application/json");
    request.body = json;
    WebAnswer answer;
    EventParser parser;
    request.response_handler = [&](const httplib::Response& response) {
      answer.status = response.status;
      answer.headers = response.headers;
      return true;
    };
    request.content_receiver = [&](const char* bytes, size_t size, uint64_t, uint64_t) {
      if (answer.status != 200) {
        answer.body.append(bytes, size);
        return true;
      }
      for (const WebEvent& event : parser.Take({bytes, size})) {
        if (!take(event)) return false;
      }
      return true;
    };
    httplib::Response response;
    httplib::Error error;
    client_->send(request, response, error);
    return answer;
  }

 private:
  static WebAnswer ToAnswer(const httplib::Result& result) {
    EXPECT_TRUE(result) << httplib::to_string(result.error());
    return result ? WebAnswer{result->status, result->headers, result->body} : WebAnswer();
  }

  std::string address_;
  std::unique_ptr<httplib::Client> client_;
};

// Returns the sequence of the estimate that an event carries; −1 for another event.
inline int64_t SequenceOf(const WebEvent& event) {
  v1::WatchSessionResponse response;
  if (!event.name.empty() || !FromJson(event.data, response).ok()) return -1;
  return response.has_estimate() ? response.estimate().sequence() : -1;
}

class WebTest : public DaemonTest {
 protected:
  explicit WebTest(std::vector<std::string> arguments = {})
      : DaemonTest([&] {
          arguments.insert(arguments.begin(), {"--web", "127.0.0.1:0"});
          return arguments;
        }()) {}

  void SetUp() override {
    DaemonTest::SetUp();
    web_ = std::make_unique<WebClientOfTest>(daemon_.ReadLine());
  }

  // Returns the JSON of a request that creates the oscillator's session.
  static std::string CreateJson(const std::string& id) {
    v1::CreateSessionRequest request;
    request.set_session_id(id);
    *request.mutable_session()->mutable_problem() = Oscillator();
    return ToJson(request, false);
  }
  static std::string AddJson(const std::string& session, int64_t sequence,
                             const v1::Measurements& rows) {
    v1::AddMeasurementsRequest request;
    request.set_session(session);
    request.set_sequence(sequence);
    *request.mutable_measurements() = rows;
    return ToJson(request, false);
  }

  std::unique_ptr<WebClientOfTest> web_;
};

}  // namespace polyest::internal
