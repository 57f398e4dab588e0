// Tests the streams of the HTTP port: events while data come in, and their ends.

#include <signal.h>

#include <thread>

#include "tests/integration/web_fixture.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

class WebStreamTest : public WebTest {
 protected:
  void SetUp() override {
    WebTest::SetUp();
    ASSERT_TRUE(Create("rig").ok());
    ASSERT_TRUE(Add("sessions/rig", 1, OscillatorRows(0, 5)).ok());
  }

  WebAnswer Watch(const std::function<bool(const WebEvent&)>& take) {
    return web_->Stream("SessionService/WatchSession", R"({"session": "sessions/rig"})", take);
  }
  int64_t Watchers() {
    grpc::ClientContext context;
    v1::DaemonStatus status;
    EXPECT_TRUE(status_->GetStatus(&context, {}, &status).ok());
    return status.watcher_count();
  }
};

TEST_F(WebStreamTest, ShowsEstimatesWhileDataComeIn) {
  std::vector<int64_t> seen;
  const WebAnswer answer = Watch([&](const WebEvent& event) {
    seen.push_back(SequenceOf(event));
    if (seen.size() == 4) {
      EXPECT_EQ(event.data, [&] {
        v1::WatchSessionResponse response;
        *response.mutable_estimate() = EstimateOf("sessions/rig");
        return ToJson(response, false);
      }());
      return false;
    }
    const auto next = static_cast<int>(seen.size()) + 1;
    EXPECT_TRUE(Add("sessions/rig", next, OscillatorRows(5 * (next - 1), 5 * next)).ok());
    return true;
  });
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.Header("Content-Type"), "text/event-stream");
  EXPECT_EQ(answer.Header("Cache-Control"), "no-store");
  EXPECT_THAT(seen, ::testing::ElementsAre(1, 2, 3, 4));
}

TEST_F(WebStreamTest, FailsUnderItsStatusBeforeItsFirstEvent) {
  const auto none = [](const WebEvent&) { return false; };
  const WebAnswer answer =
      web_->Stream("SessionService/WatchSession", R"({"session": "sessions/none"})", none);
  EXPECT_EQ(answer.status, 404);
  EXPECT_EQ(answer.Code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(WebStreamTest, FailsByAnEventLater) {
  std::vector<WebEvent> events;
  Watch([&](const WebEvent& event) {
    events.push_back(event);
    if (events.size() == 1) {
      EXPECT_TRUE(Delete("sessions/rig").ok());
    }
    return true;
  });
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[1].name, "error");
  EXPECT_THAT(events[1].data, HasSubstr(R"("code":5,"message":"sessions/rig has been deleted")"));
}

TEST_F(WebStreamTest, EndsWhenAllHasBeenSent) {
  std::vector<WebEvent> events;
  web_->Stream("SessionService/ExportSession", R"({"name": "sessions/rig"})",
               [&](const WebEvent& event) {
                 events.push_back(event);
                 return true;
               });
  grpc::ClientContext context;
  v1::ExportSessionRequest request;
  request.set_name("sessions/rig");
  const auto reader = sessions_->ExportSession(&context, request);
  size_t records = 0;
  for (v1::SessionRecord record; reader->Read(&record); ++records) {
    ASSERT_LT(records, events.size());
    EXPECT_EQ(events[records].data, ToJson(record, false));
  }
  EXPECT_TRUE(reader->Finish().ok());
  ASSERT_EQ(events.size(), records + 1);
  EXPECT_EQ(events.back().name, "end");
  EXPECT_EQ(events.back().data, "{}");
}

TEST_F(WebStreamTest, IsCancelledWhenItsClientGoes) {
  Watch([&](const WebEvent&) {
    EXPECT_EQ(Watchers(), 1);
    return false;
  });
  web_.reset();
  while (Watchers() != 0) std::this_thread::yield();
}

// All who look at one session take one of the daemon's watches.
TEST_F(WebStreamTest, IsOneWatchForAllWhoAskAlike) {
  constexpr int kClients = 20;
  std::vector<std::unique_ptr<WebClientOfTest>> clients;
  std::vector<std::thread> threads;
  std::atomic<int> watching = 0;
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(std::make_unique<WebClientOfTest>("web page on " + web_->address() + "/"));
    threads.emplace_back([&, client = clients.back().get()] {
      std::vector<int64_t> seen;
      client->Stream("SessionService/WatchSession", R"({"session": "sessions/rig"})",
                     [&](const WebEvent& event) {
                       if (seen.empty()) ++watching;
                       seen.push_back(SequenceOf(event));
                       return seen.back() != 2;
                     });
      EXPECT_THAT(seen, ::testing::ElementsAre(1, 2));
    });
  }
  while (watching < kClients) std::this_thread::yield();
  EXPECT_EQ(Watchers(), 1);
  EXPECT_TRUE(Add("sessions/rig", 2, OscillatorRows(5, 10)).ok());
  for (std::thread& thread : threads) thread.join();
}

// The rig wants one estimate, at its end, so that none has been made since the first client came.
TEST_F(WebStreamTest, BeginsWithThePresentEstimateForWhoComesLater) {
  std::vector<int64_t> seen;
  grpc::ClientContext context;
  const auto stream = sessions_->StreamMeasurements(&context);
  Watch([&](const WebEvent& event) {
    EXPECT_EQ(SequenceOf(event), 1);
    v1::StreamMeasurementsRequest request;
    request.set_session("sessions/rig");
    request.set_sequence(2);
    *request.mutable_measurements() = OscillatorRows(5, 10);
    request.mutable_estimates()->set_only_last(true);
    EXPECT_TRUE(stream->Write(request));
    v1::StreamMeasurementsResponse response;
    EXPECT_TRUE(stream->Read(&response));
    EXPECT_TRUE(response.has_acknowledgement());
    WebClientOfTest later("web page on " + web_->address() + "/");
    later.Stream("SessionService/WatchSession", R"({"session": "sessions/rig"})",
                 [&](const WebEvent& next) {
                   seen.push_back(SequenceOf(next));
                   return seen.back() == 1;
                 });
    return false;
  });
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.back(), 2);
  stream->WritesDone();
  for (v1::StreamMeasurementsResponse rest; stream->Read(&rest);) continue;
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(WebStreamTest, EndsUnavailableWhenTheDaemonIsStopped) {
  std::vector<WebEvent> events;
  Watch([&](const WebEvent& event) {
    if (events.empty()) daemon_.Signal(SIGTERM);
    events.push_back(event);
    return true;
  });
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[1].name, "error");
  EXPECT_THAT(events[1].data, HasSubstr(R"("code":14,)"));
  EXPECT_THAT(events[1].data, HasSubstr("SHUTTING_DOWN"));
  EXPECT_EQ(daemon_.Wait(), 0);
}

// More streams than there may be, and connections besides.
TEST_F(WebStreamTest, LeavesRoomForOtherCalls) {
  std::vector<std::unique_ptr<WebClientOfTest>> clients;
  std::vector<std::thread> threads;
  std::atomic<int> watching = 0;
  std::atomic<int> busy = 0;
  std::atomic<bool> over = false;
  constexpr int kClients = 330;
  const std::string line = "web page on " + web_->address() + "/";
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(std::make_unique<WebClientOfTest>(line));
    threads.emplace_back([&, client = clients.back().get()] {
      const WebAnswer answer =
          client->Stream("SessionService/WatchSession", R"({"session": "sessions/rig"})",
                         [&](const WebEvent&) { return ++watching > 0 && !over; });
      if (answer.status == 429) {
        EXPECT_THAT(answer.Message(), HasSubstr("320 streams"));
        EXPECT_EQ(answer.Header("Retry-After"), "1");
        ++busy;
      }
    });
  }
  while (watching + busy < kClients) std::this_thread::yield();
  EXPECT_EQ(busy, kClients - 320);
  EXPECT_EQ(web_->Post("SessionService/ListSessions", "{}").status, 200);
  over = true;
  EXPECT_TRUE(Delete("sessions/rig").ok());
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace polyest::internal
