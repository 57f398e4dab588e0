#include "server/web/http_connection.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// Answers with what it was asked.
class Echo final : public HttpHandler {
 public:
  std::optional<HttpAnswer> AnswerHead(const HttpRequest& request) const override {
    if (request.path == "/refused") return HttpAnswer{.status = 403, .body = "refused\n"};
    return std::nullopt;
  }
  HttpAnswer Answer(const HttpRequest& request, const std::string& body) const override {
    if (request.path == "/throws") throw std::runtime_error("secret");
    if (request.path == "/large") return {.body = std::string(3 << 20, 'x')};
    HttpAnswer answer{.content_type = "text/plain"};
    if (request.path == "/events") {
      answer.events = [](const HttpAnswer::Send& send) {
        send("one\n");
        send("two\n");
      };
      return answer;
    }
    answer.body = "[" + request.method + " " + request.path + " " + body + "]";
    return answer;
  }
  HttpAnswer Refusal(int status, std::string_view why) const override {
    return {.status = status, .body = std::string(why) + "\n"};
  }
  void OnAnswer(int status) const override {
    const std::lock_guard lock(mutex);
    answered.push_back(status);
  }

  mutable std::mutex mutex;
  mutable std::vector<int> answered;
};

// A connection with the client's end at hand.
class HttpConnectionTest : public testing::Test {
 protected:
  void Start(const HttpLimits& limits, int64_t memory_bytes = 1 << 20) {
    int ends[2];
    POLYEST_CHECK(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0);
    client_ = ends[0];
    fcntl(ends[1], F_SETFL, O_NONBLOCK);
    stop_ = eventfd(0, EFD_CLOEXEC);
    memory_.emplace(memory_bytes);
    server_ = std::thread([this, limits, end = ends[1]] {
      ClientSocket socket(end, nullptr);
      ServeConnection(socket, stop_, limits, *memory_, echo_);
    });
  }
  void SetUp() override { limits_.body_bytes = 1'000; }
  ~HttpConnectionTest() override { Finish(); }
  // Ends the connection.
  void Finish() {
    if (client_ >= 0) close(client_);
    if (server_.joinable()) server_.join();
    if (stop_ >= 0) close(stop_);
    client_ = stop_ = -1;
  }

  void Send(const std::string& text) const {
    EXPECT_EQ(send(client_, text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
  }
  // Returns everything up to `end`, or to the end of the connection.
  std::string ReadUntil(const std::string& end) const {
    std::string text;
    char byte = 0;
    while (!text.ends_with(end) && recv(client_, &byte, 1, 0) == 1) text += byte;
    return text;
  }
  // Returns everything that comes until the connection ends.
  std::string ReadAll() const {
    std::string text;
    char bytes[65'536];
    for (ssize_t count = 1; (count = recv(client_, bytes, sizeof(bytes), 0)) > 0;) {
      text.append(bytes, static_cast<size_t>(count));
    }
    return text;
  }
  // Returns the answer to the only request of a connection.
  std::string Ask(const std::string& request, int64_t memory_bytes = 1 << 20) {
    Start(limits_, memory_bytes);
    Send(request);
    shutdown(client_, SHUT_WR);
    std::string answer = ReadAll();
    Finish();
    return answer;
  }

  HttpLimits limits_;
  Echo echo_;
  std::optional<BodyMemory> memory_;
  int client_ = -1;
  int stop_ = -1;
  std::thread server_;
};

TEST_F(HttpConnectionTest, AnswersOneRequestAfterTheOther) {
  Start(limits_);
  Send("GET /a HTTP/1.1\r\nHost: h\r\n\r\n");
  EXPECT_THAT(ReadUntil("]"), HasSubstr("[GET /a ]"));
  Send("POST /b HTTP/1.1\r\nHost: h\r\nContent-Length: 3\r\n\r\nxyz");
  EXPECT_THAT(ReadUntil("]"), HasSubstr("[POST /b xyz]"));
  // Without a length there is no body.
  Send("POST /c HTTP/1.1\r\nHost: h\r\n\r\n");
  EXPECT_THAT(ReadUntil("]"), HasSubstr("[POST /c ]"));
  Send(
      "POST /d HTTP/1.1\r\nHost: h\r\nTransfer-Encoding: "
      "chunked\r\n\r\n2\r\nxy\r\n1\r\nz\r\n0\r\n\r\n");
  EXPECT_THAT(ReadUntil("]"), HasSubstr("[POST /d xyz]"));
}

// Who counts answers must not see fewer than a client that has them.
TEST_F(HttpConnectionTest, NotesAnAnswerBeforeItIsSent) {
  Start(limits_);
  for (int count = 1; count <= 100; ++count) {
    Send("GET /a HTTP/1.1\r\nHost: h\r\n\r\n");
    ASSERT_THAT(ReadUntil("]"), HasSubstr("200 OK"));
    const std::lock_guard lock(echo_.mutex);
    ASSERT_EQ(echo_.answered.size(), count);
  }
}

TEST_F(HttpConnectionTest, AnswersRequestsThatComeAtOnce) {
  const std::string answers =
      Ask("POST /a HTTP/1.1\r\nHost: h\r\nContent-Length: 1\r\n\r\n1"
          "GET /b HTTP/1.1\r\nHost: h\r\n\r\n");
  EXPECT_THAT(answers, HasSubstr("[POST /a 1]"));
  EXPECT_THAT(answers, HasSubstr("[GET /b ]"));
}

TEST_F(HttpConnectionTest, SendsEventsInChunks) {
  EXPECT_THAT(Ask("GET /events HTTP/1.1\r\nHost: h\r\nConnection: close\r\n\r\n"),
              HasSubstr("\r\n\r\n4\r\none\n\r\n4\r\ntwo\n\r\n0\r\n\r\n"));
  EXPECT_THAT(echo_.answered, ElementsAre(200));
}

TEST_F(HttpConnectionTest, CompressesNothingAndSendsNoParts) {
  const std::string answer = Ask(
      "GET /abcdef HTTP/1.1\r\nHost: h\r\nAccept-Encoding: gzip, br\r\nRange: bytes=0-1\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer, HasSubstr("[GET /abcdef ]"));
}

TEST_F(HttpConnectionTest, ClosesAfterARefusalWhoseBodyItHasNotRead) {
  const std::string answer =
      Ask("POST /refused HTTP/1.1\r\nHost: h\r\nContent-Length: 40\r\n\r\n"
          "GET /smuggled HTTP/1.1\r\nHost: h\r\n\r\n   ");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(answer, HasSubstr("Connection: close"));
  EXPECT_THAT(answer, Not(HasSubstr("smuggled")));
}

TEST_F(HttpConnectionTest, AnswersBeforeABodyThatTheClientOffersFirst) {
  Start(limits_);
  Send("POST /a HTTP/1.1\r\nHost: h\r\nContent-Length: 2\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_THAT(ReadUntil("\r\n\r\n"), StartsWith("HTTP/1.1 100"));
  Send("xy");
  EXPECT_THAT(ReadUntil("]"), HasSubstr("[POST /a xy]"));
  Send("POST /refused HTTP/1.1\r\nHost: h\r\nContent-Length: 2\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_THAT(ReadUntil("refused\n"), StartsWith("HTTP/1.1 403"));
}

// Two ways to say how long a body is are how one request is hidden in another.
TEST_F(HttpConnectionTest, RefusesABodyWhoseLengthIsNotClear) {
  for (const char* headers :
       {"Content-Length: 3\r\nContent-Length: 3\r\n",
        "Content-Length: 3\r\nTransfer-Encoding: chunked\r\n", "Content-Length: +3\r\n",
        "Content-Length: 3x\r\n", "Content-Length: -1\r\n",
        "Content-Length: 99999999999999999999999\r\n", "Transfer-Encoding: gzip, chunked\r\n",
        "Transfer-Encoding: chunked\r\nTransfer-Encoding: identity\r\n",
        "Transfer-Encoding: xchunked\r\n"}) {
    const std::string answer = Ask(std::string("POST /a HTTP/1.1\r\nHost: h\r\n") + headers +
                                   "\r\n0\r\n\r\nGET /smuggled HTTP/1.1\r\nHost: h\r\n\r\n");
    EXPECT_THAT(answer, AnyOf(StartsWith("HTTP/1.1 400"), StartsWith("HTTP/1.1 501"),
                              StartsWith("HTTP/1.1 413")))
        << headers;
    EXPECT_THAT(answer, Not(HasSubstr("smuggled"))) << headers;
  }
  EXPECT_THAT(Ask("GET /a HTTP/1.1\r\nHost: h\r\nContent-Length: 2\r\n\r\nxy"),
              StartsWith("HTTP/1.1 400"));
}

TEST_F(HttpConnectionTest, RefusesTooLargeBodiesHoweverTheyCome) {
  const std::string head = "POST /a HTTP/1.1\r\nHost: h\r\n";
  EXPECT_THAT(Ask(head + "Content-Length: 1000\r\n\r\n" + std::string(1'000, 'x')),
              StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Ask(head + "Content-Length: 1001\r\n\r\n" + std::string(1'001, 'x')),
              StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(Ask(head + "Transfer-Encoding: chunked\r\n\r\n3e9\r\n" + std::string(1'001, 'x') +
                  "\r\n0\r\n\r\n"),
              StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(Ask(head + "Content-Length: 5\r\nContent-Encoding: gzip\r\n\r\nxxxxx"),
              StartsWith("HTTP/1.1 415"));
}

// What is around the chunks counts against no limit of bodies.
TEST_F(HttpConnectionTest, RefusesLongLinesAroundChunks) {
  limits_.body_bytes = 100'000;
  const std::string head = "POST /a HTTP/1.1\r\nHost: h\r\nTransfer-Encoding: chunked\r\n\r\n";
  const std::string end = "\r\n0\r\n\r\n";
  const std::string zeros(10'000, '0');
  EXPECT_THAT(Ask(head + "c350\r\n" + std::string(50'000, 'x') + end), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Ask(head + "00000001\r\nx" + end), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Ask(head + zeros + "1\r\nx" + end), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(Ask(head + "1\r\nx\r\n" + zeros + "1\r\nx" + end), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(Ask(head + "1\r\nx\r\n0\r\nTrailer: " + zeros + "\r\n\r\n"),
              StartsWith("HTTP/1.1 400"));
}

TEST_F(HttpConnectionTest, HoldsNoMoreBodiesThanThereIsMemoryFor) {
  const std::string head = "POST /a HTTP/1.1\r\nHost: h\r\n";
  const std::string request = head + "Content-Length: 600\r\n\r\n" + std::string(600, 'x');
  EXPECT_THAT(Ask(request, 599), StartsWith("HTTP/1.1 429"));
  EXPECT_THAT(Ask(request, 600), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Ask("GET /large HTTP/1.1\r\nHost: h\r\n\r\n", 2 << 20), StartsWith("HTTP/1.1 429"));
  EXPECT_THAT(Ask("POST /large HTTP/1.1\r\nHost: h\r\nContent-Length: 1\r\n\r\nx", 2 << 20),
              StartsWith("HTTP/1.1 429"));
  EXPECT_THAT(Ask("POST /large HTTP/1.1\r\nHost: h\r\nContent-Length: 1\r\n\r\nx", 4 << 20),
              StartsWith("HTTP/1.1 200"));
}

// A request that has changed something is not refused its answer, which may repeat all of it.
TEST_F(HttpConnectionTest, GivesAnAnswerTheMemoryOfItsRequest) {
  constexpr int kBytes = 3 << 20;
  limits_.body_bytes = kBytes;
  EXPECT_THAT(Ask("POST /a HTTP/1.1\r\nHost: h\r\nContent-Length: " + std::to_string(kBytes) +
                      "\r\n\r\n" + std::string(kBytes, 'x'),
                  kBytes),
              StartsWith("HTTP/1.1 200"));
}

TEST_F(HttpConnectionTest, HoldsNoMemoryBetweenTwoRequests) {
  Start(limits_, 600);
  for (int i = 0; i < 3; ++i) {
    Send("POST /a HTTP/1.1\r\nHost: h\r\nContent-Length: 600\r\n\r\n" + std::string(600, 'x'));
    EXPECT_THAT(ReadUntil("]"), StartsWith("HTTP/1.1 200"));
  }
  BodyMemory::Share share(*memory_);
  // The answer may have come before its memory is given back.
  while (!share.Take(600)) std::this_thread::yield();
}

TEST_F(HttpConnectionTest, RefusesABodyThatEndsTooEarly) {
  EXPECT_THAT(Ask("POST /a HTTP/1.1\r\nHost: h\r\nContent-Length: 5\r\n\r\nxy"),
              StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(Ask("POST /a HTTP/1.1\r\nHost: h\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\nxy"),
              StartsWith("HTTP/1.1 400"));
}

TEST_F(HttpConnectionTest, RefusesAHeadThatIsTooLong) {
  const std::string begin = "GET /a HTTP/1.1\r\nHost: h\r\n";
  EXPECT_THAT(Ask("GET /" + std::string(9'000, 'a') + " HTTP/1.1\r\nHost: h\r\n\r\n"),
              StartsWith("HTTP/1.1 414"));
  EXPECT_THAT(Ask(begin + "X: " + std::string(9'000, 'a') + "\r\n\r\n"),
              StartsWith("HTTP/1.1 400"));
  limits_.head_bytes = 2'000;
  std::string many = begin;
  for (int i = 0; i < 100; ++i)
    many += "X-" + std::to_string(i) + ": " + std::string(20, 'a') + "\r\n";
  EXPECT_THAT(Ask(many + "\r\n"), StartsWith("HTTP/1.1 431"));
  // A line without an end is not a request that could be answered.
  limits_.head_bytes = 100'000;
  EXPECT_EQ(Ask(std::string(150'000, 'a')), "");
}

TEST_F(HttpConnectionTest, GivesUpAClientWhoseHeadDoesNotEnd) {
  limits_.head = std::chrono::milliseconds(50);
  limits_.head_bytes = size_t{1} << 40;
  Start(limits_);
  Send("GET /a HTTP/1.1\r\nHost: h\r\n");
  std::thread slow([&] {
    while (send(client_, "X: a\r\n", 6, MSG_NOSIGNAL) == 6) {
    }
  });
  EXPECT_THAT(ReadUntil("\r\n"), StartsWith("HTTP/1.1 408"));
  ReadAll();
  shutdown(client_, SHUT_RDWR);
  slow.join();
}

TEST_F(HttpConnectionTest, GivesUpAClientThatDoesNotSendItsBody) {
  limits_.transfer = std::chrono::milliseconds(50);
  Start(limits_);
  Send("POST /a HTTP/1.1\r\nHost: h\r\nContent-Length: 10\r\n\r\nx");
  EXPECT_THAT(ReadUntil("\r\n"), StartsWith("HTTP/1.1 408"));
}

TEST_F(HttpConnectionTest, GivesUpAClientThatDoesNotReadItsAnswer) {
  limits_.transfer = std::chrono::milliseconds(50);
  limits_.bytes_a_second = int64_t{1} << 30;
  Start(limits_, 8 << 20);
  Send("POST /large HTTP/1.1\r\nHost: h\r\nContent-Length: 1\r\n\r\nx");
  server_.join();
  EXPECT_LT(ReadAll().size(), size_t{3} << 20);
}

TEST_F(HttpConnectionTest, EndsAfterItsNumberOfRequestsAndWhenNoneComes) {
  limits_.requests = 2;
  EXPECT_THAT(Ask("GET /a HTTP/1.1\r\nHost: h\r\n\r\nGET /b HTTP/1.1\r\nHost: h\r\n\r\n"
                  "GET /c HTTP/1.1\r\nHost: h\r\n\r\n"),
              AllOf(HasSubstr("[GET /b ]"), HasSubstr("Connection: close"), Not(HasSubstr("/c"))));
  limits_.idle = std::chrono::milliseconds(1);
  Start(limits_);
  EXPECT_EQ(ReadAll(), "");
}

TEST_F(HttpConnectionTest, EndsBetweenTwoRequestsWhenItIsToStop) {
  Start(limits_);
  Send("GET /a HTTP/1.1\r\nHost: h\r\n\r\n");
  ReadUntil("]");
  const uint64_t one = 1;
  ASSERT_EQ(write(stop_, &one, sizeof(one)), static_cast<ssize_t>(sizeof(one)));
  EXPECT_EQ(ReadAll(), "");
}

TEST_F(HttpConnectionTest, TellsNobodyWhatWentWrongInside) {
  const std::string answer = Ask("GET /throws HTTP/1.1\r\nHost: h\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 500"));
  EXPECT_THAT(answer, Not(HasSubstr("secret")));
}

TEST_F(HttpConnectionTest, BearsWhateverBytesCome) {
  const std::string kGarbage[] = {
      std::string("\0\0\0\0", 4),
      "\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",  // TLS
      "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
      "GET\r\n\r\n",
      "GET / HTTP/9.9\r\n\r\n",
      "GET  HTTP/1.1\r\n\r\n",
      "GET / HTTP/1.1\r\nHost\r\n\r\n",
      "GET / HTTP/1.1\r\n: h\r\n\r\n",
      "GET / HTTP/1.1\nHost: h\n\n",
      "GET /%00%ff%zz?%=&&=; HTTP/1.1\r\nHost: h\r\n\r\n",
      "GET / HTTP/1.1\r\nHost: h\r\nRange: bytes=" + std::string(7'000, '1') + "-\r\n\r\n",
      "GET / HTTP/1.1\r\nHost: h\r\nRange: bytes=" + std::string(7'000, ',') + "\r\n\r\n",
      "OPTIONS * HTTP/1.1\r\nHost: h\r\n\r\n",
      "CONNECT a:1 HTTP/1.1\r\nHost: h\r\n\r\n",
      "POST / HTTP/1.1\r\nHost: h\r\nContent-Type: multipart/form-data; boundary=" +
          std::string(5'000, '-') + "\r\nContent-Length: 9\r\n\r\n---------",
      "POST / HTTP/1.1\r\nHost: h\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n",
  };
  for (const std::string& bytes : kGarbage) {
    const std::string answer = Ask(bytes);
    EXPECT_TRUE(answer.empty() || answer.starts_with("HTTP/1.1 ")) << answer;
  }
}

}  // namespace
}  // namespace polyest::internal
