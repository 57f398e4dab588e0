// Tests that evaluations survive servers that fail, and end where none is left.

#include "core/umbridge/evaluation_pool.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <future>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "tests/unit/core/umbridge/model_server.h"

namespace polyest::internal {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Json = nlohmann::json;

// A port of the loopback on which nobody listens, since it needs rights to listen there and no
// service uses it.
constexpr char kNobody[] = "http://127.0.0.1:1";

void Square(const Json& request, httplib::Response& answer) {
  const double x = request["input"][0][0];
  ModelServer::Answer({{x * x}}, answer);
}

absl::StatusOr<std::vector<Evaluation>> Squares(EvaluationPool& pool, size_t count,
                                                const Stop& stop = Stop()) {
  const auto request_of = [](size_t i) {
    return EvaluateRequest("square", {{static_cast<double>(i) / 10}}, "{}", {});
  };
  return pool.Evaluate(count, request_of, stop);
}

void ExpectSquares(const absl::StatusOr<std::vector<Evaluation>>& evaluations, int count) {
  ASSERT_TRUE(evaluations.ok()) << evaluations.status();
  ASSERT_THAT(*evaluations, SizeIs(count));
  for (int i = 0; i < count; ++i) {
    const Evaluation& evaluation = (*evaluations)[static_cast<size_t>(i)];
    EXPECT_THAT(evaluation.failure, IsEmpty());
    // The numbers go there and back without loss of a bit.
    EXPECT_THAT(evaluation.outputs, ElementsAre(ElementsAre(i / 10.0 * (i / 10.0))));
  }
}

TEST(EvaluationPool, DealsPointsOutToAllServers) {
  // Neither server answers its first request before both have one.
  std::mutex mutex;
  std::condition_variable changed;
  std::set<int> reached;
  const auto handler = [&](int server) {
    return [&, server](const Json& request, httplib::Response& answer) {
      std::unique_lock lock(mutex);
      reached.insert(server);
      changed.notify_all();
      changed.wait(lock, [&] { return reached.size() == 2; });
      Square(request, answer);
    };
  };
  ModelServer one(handler(1)), two(handler(2));
  EvaluationPool pool({.urls = {one.url(), two.url()}});
  ExpectSquares(Squares(pool, 30), 30);
  EXPECT_GE(one.requests() + two.requests(), 30);
}

TEST(EvaluationPool, DoesWithoutAServerThatCannotBeReached) {
  ModelServer good(Square);
  EvaluationPool pool({.urls = {kNobody, good.url()}});
  ExpectSquares(Squares(pool, 20), 20);
}

TEST(EvaluationPool, ComputesThePointsOfAServerThatDies) {
  ModelServer good(Square);
  std::optional<ModelServer> dying;
  // Breaks off each answer after its header.
  dying.emplace([](const Json&, httplib::Response& answer) {
    answer.set_content_provider(100, "application/json",
                                [](size_t, size_t, httplib::DataSink&) { return false; });
  });
  EvaluationPool pool({.urls = {dying->url(), good.url()}});
  ExpectSquares(Squares(pool, 40), 40);
}

// Speaks HTTP by hand: the library's own server always tells the length of an answer.
class Abrupt {
 public:
  // Answers each request with the beginning of an answer that tells no length, and hangs up.
  explicit Abrupt(std::string beginning) : beginning_(std::move(beginning)) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    EXPECT_EQ(listen(listener_, SOMAXCONN), 0);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { Serve(); });
  }
  ~Abrupt() {
    shutdown(listener_, SHUT_RDWR);
    thread_.join();
    close(listener_);
  }
  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_); }
  int answers() const { return answers_; }

 private:
  void Serve() {
    for (int client; (client = accept(listener_, nullptr, nullptr)) >= 0; close(client)) {
      std::string request(65536, '\0');
      if (recv(client, request.data(), request.size(), 0) <= 0) continue;
      const std::string answer = "HTTP/1.1 200 OK\r\n\r\n" + beginning_;
      ++answers_;
      send(client, answer.data(), answer.size(), MSG_NOSIGNAL);
    }
  }

  std::string beginning_;
  int listener_ = -1;
  int port_ = 0;
  std::atomic<int> answers_ = 0;
  std::thread thread_;
};

TEST(EvaluationPool, TakesAnAnswerWithoutLengthThatBreaksOffForALostConnection) {
  for (const std::string beginning : {"", R"({"output": [[0.)"}) {
    SCOPED_TRACE(beginning);
    Abrupt dying(beginning);
    EvaluationPool pool({.urls = std::vector<std::string>(10, dying.url())});
    const auto evaluations = Squares(pool, 1);
    ASSERT_TRUE(evaluations.ok()) << evaluations.status();
    EXPECT_EQ((*evaluations)[0].failure, "10 connections were lost while it was computed");
    EXPECT_EQ(dying.answers(), 10);
  }
  Abrupt brief(R"({"output": [[25]]})");
  EvaluationPool pool({.urls = {brief.url()}});
  const auto evaluations = Squares(pool, 1);
  ASSERT_TRUE(evaluations.ok()) << evaluations.status();
  EXPECT_THAT((*evaluations)[0].outputs, ElementsAre(ElementsAre(25)));
}

TEST(EvaluationPool, FailsAPointThatEndsEachConnection) {
  ModelServer server([](const Json& request, httplib::Response& answer) {
    if (request["input"][0][0] != 0.1) return Square(request, answer);
    answer.set_content_provider(100, "application/json",
                                [](size_t, size_t, httplib::DataSink&) { return false; });
  });
  // The same server ten times: each rests after a lost connection, and ten losses are needed.
  EvaluationPool pool({.urls = std::vector<std::string>(10, server.url())});
  const auto evaluations = Squares(pool, 3);
  ASSERT_TRUE(evaluations.ok()) << evaluations.status();
  EXPECT_THAT((*evaluations)[0].failure, IsEmpty());
  EXPECT_EQ((*evaluations)[1].failure, "10 connections were lost while it was computed");
  EXPECT_THAT((*evaluations)[2].failure, IsEmpty());
}

TEST(EvaluationPool, TakesTheModelsWordThatAPointFails) {
  ModelServer server([](const Json& request, httplib::Response& answer) {
    if (request["input"][0][0] != 0.1) return Square(request, answer);
    ModelServer::Refuse("the spring\nbreaks", answer);
  });
  EvaluationPool pool({.urls = {server.url()}});
  const auto evaluations = Squares(pool, 3);
  ASSERT_TRUE(evaluations.ok()) << evaluations.status();
  EXPECT_EQ((*evaluations)[1].failure, "InvalidInput: the spring breaks");
  EXPECT_EQ(server.requests(), 3);
}

TEST(EvaluationPool, AsksThreeTimesWhereTheAnswerIsNone) {
  const std::vector<std::string> answers = {
      "", "oops", "[1]", "{}", R"({"output": 1})", R"({"output": [1]})", R"({"output": [["a"]]})"};
  for (const std::string& text : answers) {
    SCOPED_TRACE(text);
    ModelServer server([&](const Json&, httplib::Response& answer) {
      answer.set_content(text, "application/json");
    });
    EvaluationPool pool({.urls = {server.url()}});
    const auto evaluations = Squares(pool, 1);
    ASSERT_TRUE(evaluations.ok()) << evaluations.status();
    EXPECT_THAT((*evaluations)[0].failure, HasSubstr("the answer"));
    EXPECT_EQ(server.requests(), 3);
  }
}

TEST(EvaluationPool, FailsAPointThatTakesTooLong) {
  std::promise<void> end;
  const std::shared_future<void> ended = end.get_future().share();
  ModelServer server([&](const Json& request, httplib::Response& answer) {
    if (request["input"][0][0] == 0.1) ended.wait();
    Square(request, answer);
  });
  {
    EvaluationPool pool({.urls = {server.url()}, .requests_per_server = 4, .timeout_s = 0.05});
    const auto evaluations = Squares(pool, 2);
    ASSERT_TRUE(evaluations.ok()) << evaluations.status();
    EXPECT_EQ((*evaluations)[1].failure, "no answer within 0.05 s");
  }
  end.set_value();
}

TEST(EvaluationPool, ComputesASlowPointElsewhereToo) {
  // The first server does not answer its first request while the points are computed.
  std::promise<void> end;
  const std::shared_future<void> ended = end.get_future().share();
  std::atomic<bool> stuck = false;
  ModelServer slow([&](const Json& request, httplib::Response& answer) {
    if (!stuck.exchange(true)) ended.wait();
    Square(request, answer);
  });
  ModelServer fast(Square);
  {
    EvaluationPool pool({.urls = {slow.url(), fast.url()}});
    ExpectSquares(Squares(pool, 10), 10);
    end.set_value();  // lets the server end
  }
}

TEST(EvaluationPool, SaysWhichServersCannotBeReached) {
  EvaluationPool pool({.urls = {kNobody}, .give_up_after_s = 0});
  const absl::Status status = Squares(pool, 1).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("no server could be reached for 0 s (giveUpAfterS)"),
                    HasSubstr("http://127.0.0.1:1: no connection")));
}

TEST(EvaluationPool, EndsOnAStopRequestAndServesTheNextCaller) {
  std::stop_source source;
  std::promise<void> end;
  const std::shared_future<void> ended = end.get_future().share();
  ModelServer server([&](const Json& request, httplib::Response& answer) {
    if (source.request_stop()) ended.wait();
    Square(request, answer);
  });
  EvaluationPool pool({.urls = {server.url()}, .requests_per_server = 2});
  EXPECT_EQ(Squares(pool, 5, Stop(source.get_token())).status().code(),
            absl::StatusCode::kCancelled);
  ExpectSquares(Squares(pool, 5), 5);
  end.set_value();
}

TEST(EvaluationPool, PassesOnWhatARequestThrowsAndServesTheNextCaller) {
  ModelServer server(Square);
  EvaluationPool pool({.urls = {server.url()}});
  const auto throws = [](size_t) -> std::string { throw std::runtime_error("out of order"); };
  EXPECT_THROW(pool.Evaluate(3, throws, Stop()).IgnoreError(), std::runtime_error);
  ExpectSquares(Squares(pool, 5), 5);
}

}  // namespace
}  // namespace polyest::internal
