#include "server/web/http_connection.h"

// The only file that knows the library. It parses requests and writes answers; sockets, threads,
// encryption and time limits are the daemon's own, because those of the library wait for each byte
// anew, stop at 1,024 descriptors, and share a port with any other process.
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <httplib.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <exception>
#include <optional>
#include <string>
#include <utility>

namespace polyest::internal {
namespace {

using Clock = ClientSocket::Clock;

// Bytes that are read after an answer for which the request was not read to its end: a client that
// still sends would otherwise not see the answer.
constexpr size_t kMaxLinger = size_t{256} << 20;
constexpr std::chrono::seconds kLinger{2};
// An answer that is larger than its request by more than this counts against the memory for bodies.
constexpr int64_t kLargeAnswer = 1 << 20;
// Bytes that are read from one piece of a body to the next. The library reads pieces of 4 KiB, and
// keeps the lines around chunks in memory that nobody else counts.
constexpr size_t kMaxBetweenPieces = size_t{8} << 10;

// Is the stream from which the library reads and to which it writes. Refuses to read more of a
// head, or of the lines around the pieces of a body, than is allowed.
class LimitedStream final : public httplib::Stream {
 public:
  LimitedStream(ClientSocket& socket, const HttpLimits& limits)
      : socket_(socket), limits_(limits) {}

  // Begins to count the bytes and the time of a head.
  void BeginHead() {
    left_ = limits_.head_bytes;
    status_at_limit_ = 431;
    deadline_ = Clock::now() + limits_.head;
    failure_ = 0;
  }
  // Ends the head: a body of so many bytes follows.
  void BeginBody(uint64_t bytes) {
    left_ = kMaxBetweenPieces;
    status_at_limit_ = 400;
    deadline_ = Clock::now() + TransferTime(bytes);
  }
  // A piece of the body has been taken.
  void OnPiece() { left_ = kMaxBetweenPieces; }
  // Returns the status of HTTP that says why reading failed; 0: it did not.
  int failure() const { return failure_; }

  bool is_readable() const override { return true; }
  bool is_writable() const override { return true; }
  socket_t socket() const override { return INVALID_SOCKET; }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}

  ssize_t read(char* bytes, size_t size) override {
    if (left_ == 0) {
      failure_ = status_at_limit_;
      return -1;
    }
    if (begin_ == end_) {
      begin_ = 0;
      end_ = socket_.Read(buffer_.data(), buffer_.size(), deadline_);
      // A client that sends little by little is late, too.
      if (Clock::now() >= deadline_) {
        failure_ = 408;
        return -1;
      }
      if (end_ == 0) return 0;
    }
    const size_t count = std::min({size, end_ - begin_, left_});
    std::copy_n(buffer_.data() + begin_, count, bytes);
    begin_ += count;
    left_ -= count;
    return static_cast<ssize_t>(count);
  }

  ssize_t write(const char* bytes, size_t size) override {
    broken_ = broken_ || !socket_.Write({bytes, size}, Clock::now() + TransferTime(size));
    return broken_ ? -1 : static_cast<ssize_t>(size);
  }

  // Returns whether the client does not read any more.
  bool broken() const { return broken_; }
  // Returns whether a part of the next request has come already.
  bool HasBuffered() const { return begin_ != end_; }

 private:
  std::chrono::milliseconds TransferTime(uint64_t bytes) const {
    return limits_.transfer +
           std::chrono::milliseconds(1'000 * bytes / static_cast<uint64_t>(limits_.bytes_a_second));
  }

  ClientSocket& socket_;
  const HttpLimits& limits_;
  std::array<char, 16'384> buffer_;
  size_t begin_ = 0;
  size_t end_ = 0;
  size_t left_ = 0;  // bytes that may still be read
  int status_at_limit_ = 0;
  Clock::time_point deadline_;
  int failure_ = 0;
  bool broken_ = false;
};

// The requests of one connection. The library has its handlers in a server, and gives them no
// connection.
class RequestLoop final : private httplib::Server {
 public:
  RequestLoop(ClientSocket& socket, const HttpLimits& limits, BodyMemory& memory,
              const HttpHandler& handler);

  // Serves requests until the connection ends, or `stop` is readable between two of them.
  void Serve(int stop);

 private:
  // Has the library answer as the handler does when it or the handler fails.
  void AnswerFailures();
  // Looks at the head of a request before the library goes on with it.
  void OnHead(httplib::Request& request);
  // Returns why the body that the head announces cannot be read, if it cannot.
  std::optional<HttpAnswer> CheckBody(const httplib::Request& request);
  HttpAnswer TooLarge() const;
  void OnBody(httplib::Response& response, const httplib::ContentReader& reader);
  // Reads the body; a refusal if that fails.
  std::optional<HttpAnswer> ReadBody(const httplib::ContentReader& reader, std::string& body);
  // Has the request answered; refuses it if there is no memory for the answer.
  void PutAnswer(std::string body, httplib::Response& response);
  // Gives the library the answer.
  void Put(HttpAnswer answer, httplib::Response& response) const;
  // Reads what the client still sends, for a short time.
  void Linger();

  ClientSocket& socket_;
  const HttpLimits& limits_;
  BodyMemory& memory_;
  const HttpHandler& handler_;
  LimitedStream stream_;
  // These belong to the present request.
  HttpRequest request_;
  std::optional<HttpAnswer> refusal_;
  std::optional<BodyMemory::Share> share_;
  bool has_body_ = false;
  bool close_ = false;  // after the answer
};

RequestLoop::RequestLoop(ClientSocket& socket, const HttpLimits& limits, BodyMemory& memory,
                         const HttpHandler& handler)
    : socket_(socket),
      limits_(limits),
      memory_(memory),
      handler_(handler),
      stream_(socket, limits) {
  set_keep_alive_max_count(static_cast<size_t>(limits.requests));
  set_keep_alive_timeout(std::chrono::duration_cast<std::chrono::seconds>(limits.idle).count());
  svr_sock_ = socket.descriptor();  // to the library, a server without a socket has been stopped
  set_expect_100_continue_handler([this](const httplib::Request&, httplib::Response& response) {
    if (!refusal_) return 100;
    Put(*refusal_, response);
    return response.status;
  });
  set_pre_routing_handler([this](const httplib::Request&, httplib::Response& response) {
    if (!refusal_ && has_body_) return HandlerResponse::Unhandled;
    if (refusal_) {
      Put(*std::move(refusal_), response);
    } else {
      PutAnswer("", response);
    }
    return HandlerResponse::Handled;
  });
  Post(".*", [this](const httplib::Request&, httplib::Response& response,
                    const httplib::ContentReader& reader) { OnBody(response, reader); });
  // Before the answer is sent: whoever has it finds it counted.
  set_post_routing_handler([this](const httplib::Request&, const httplib::Response& response) {
    handler_.OnAnswer(response.status);
  });
  AnswerFailures();
}

void RequestLoop::AnswerFailures() {
  set_error_handler([this](const httplib::Request&, httplib::Response& response) {
    if (!response.body.empty()) return;
    close_ = true;
    if (stream_.failure() != 0) response.status = stream_.failure();
    Put(handler_.Refusal(response.status, "the request is not well-formed HTTP, or too long"),
        response);
  });
  set_exception_handler(
      [this](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
        close_ = true;
        Put(handler_.Refusal(500, "unexpected error"), response);
      });
}

void RequestLoop::Serve(int stop) {
  request_.peer = socket_.Peer();
  request_.local_host = socket_.LocalHost();
  request_.certificate_name = socket_.CertificateName();
  request_.client = socket_.descriptor();
  for (int count = 1; count <= limits_.requests; ++count) {
    if (!stream_.HasBuffered() && !socket_.AwaitReadable(stop, Clock::now() + limits_.idle)) return;
    stream_.BeginHead();
    refusal_.reset();
    share_.emplace(memory_);
    has_body_ = false;
    close_ = false;
    bool last = false;
    const bool answered = process_request(stream_, count == limits_.requests, last,
                                          [this](httplib::Request& request) { OnHead(request); });
    share_.reset();
    if (!answered || last || close_) break;
  }
  if (!stream_.broken()) Linger();
}

void RequestLoop::OnHead(httplib::Request& request) {
  request_.method = request.method;
  request_.path = request.path;
  request_.headers = {request.headers.begin(), request.headers.end()};
  refusal_ = CheckBody(request);
  if (!refusal_) refusal_ = handler_.AnswerHead(request_);
  close_ = close_ || (refusal_ && has_body_);
  if (close_) {
    request.headers.erase("Connection");
    request.headers.emplace("Connection", "close");
  }
  // Compressing costs more than it gains, and parts of answers are of no use.
  request.headers.erase("Accept-Encoding");
  request.headers.erase("Range");
  request.ranges.clear();
}

std::optional<HttpAnswer> RequestLoop::CheckBody(const httplib::Request& request) {
  const size_t lengths = request.get_header_value_count("Content-Length");
  const size_t encodings = request.get_header_value_count("Transfer-Encoding");
  has_body_ = encodings > 0;
  uint64_t length = limits_.body_bytes;
  if (lengths > 0) {
    has_body_ = !absl::SimpleAtoi(request.get_header_value("Content-Length"), &length) ||
                length > 0 || encodings > 0;
    if (lengths > 1 || encodings > 0 ||
        !std::ranges::all_of(request.get_header_value("Content-Length"),
                             [](char c) { return c >= '0' && c <= '9'; })) {
      close_ = true;
      return handler_.Refusal(400, "the length of the body is not clear");
    }
  }
  if (encodings > 0 &&
      (encodings > 1 ||
       !absl::EqualsIgnoreCase(request.get_header_value("Transfer-Encoding"), "chunked"))) {
    close_ = true;
    return handler_.Refusal(501, "Transfer-Encoding can only be chunked");
  }
  if (!has_body_) return std::nullopt;
  stream_.BeginBody(std::min<uint64_t>(length, limits_.body_bytes));
  if (request.method != "POST") return handler_.Refusal(400, "only POST may have a body");
  if (lengths > 0 && length > limits_.body_bytes) return TooLarge();
  if (request.has_header("Content-Encoding")) {
    return handler_.Refusal(415, "the body must not be compressed");
  }
  return std::nullopt;
}

HttpAnswer RequestLoop::TooLarge() const {
  return handler_.Refusal(413, absl::StrCat("the body has more than ", limits_.body_bytes >> 20,
                                            " MiB (--max-message-mb)"));
}

std::optional<HttpAnswer> RequestLoop::ReadBody(const httplib::ContentReader& reader,
                                                std::string& body) {
  bool too_large = false;
  bool no_memory = false;
  const bool read = reader([&](const char* bytes, size_t size) {
    stream_.OnPiece();
    too_large = body.size() + size > limits_.body_bytes;
    if (too_large) return false;
    no_memory = !share_->Take(static_cast<int64_t>(size));
    if (no_memory) return false;
    body.append(bytes, size);
    return true;
  });
  if (read) return std::nullopt;
  close_ = true;
  if (too_large) return TooLarge();
  if (no_memory) return handler_.Refusal(429, "too many large requests at once; try again later");
  if (stream_.failure() == 408) return handler_.Refusal(408, "the body is too slow");
  return handler_.Refusal(400, "the body ends too early, or its chunks are wrong");
}

void RequestLoop::OnBody(httplib::Response& response, const httplib::ContentReader& reader) {
  std::string body;
  std::optional<HttpAnswer> refused = ReadBody(reader, body);
  if (refused) {
    response.set_header("Connection", "close");
    return Put(*std::move(refused), response);
  }
  PutAnswer(std::move(body), response);
}

void RequestLoop::PutAnswer(std::string body, httplib::Response& response) {
  HttpAnswer answer = handler_.Answer(request_, body);
  // The answer takes over the memory of the request, which may have changed something.
  const auto more = std::ssize(answer.body) - std::ssize(body);
  body = std::string();
  if (more > kLargeAnswer && !share_->Take(more)) {
    answer = handler_.Refusal(429, "too many large answers are unread; read them first");
  }
  Put(std::move(answer), response);
}

void RequestLoop::Put(HttpAnswer answer, httplib::Response& response) const {
  response.status = answer.status;
  for (auto& [name, value] : answer.headers) response.set_header(name, value);
  if (answer.events == nullptr) {
    response.body = std::move(answer.body);
    response.headers.erase("Content-Type");
    if (!answer.content_type.empty()) response.set_header("Content-Type", answer.content_type);
    return;
  }
  response.set_chunked_content_provider(
      answer.content_type, [events = std::move(answer.events)](size_t, httplib::DataSink& sink) {
        bool sent = true;
        events([&](std::string_view bytes) {
          sent = sent && sink.write(bytes.data(), bytes.size());
          return sent;
        });
        if (sent) sink.done();
        return sent;
      });
}

void RequestLoop::Linger() {
  const Clock::time_point deadline = Clock::now() + kLinger;
  socket_.FinishWriting(deadline);
  std::array<char, 16'384> bytes;
  for (size_t total = 0; total < kMaxLinger;) {
    const size_t count = socket_.Read(bytes.data(), bytes.size(), deadline);
    if (count == 0) return;
    total += count;
  }
}

}  // namespace

void ServeConnection(ClientSocket& socket, int stop, const HttpLimits& limits, BodyMemory& memory,
                     const HttpHandler& handler) {
  if (!socket.Begin(ClientSocket::Clock::now() + limits.idle)) return;
  // Whatever the library throws, or want of memory, ends this connection only.
  try {
    RequestLoop(socket, limits, memory, handler).Serve(stop);
  } catch (const std::exception& error) {
    spdlog::error("a connection over HTTP ends: {}", error.what());
  }
}

}  // namespace polyest::internal
