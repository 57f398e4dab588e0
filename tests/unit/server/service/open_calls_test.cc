#include "server/service/open_calls.h"

#include <gtest/gtest.h>

#include <functional>

namespace polyest::internal {
namespace {

using Kind = OpenCalls::Kind;

struct Stream : Drainable {
  explicit Stream(std::function<void()> drain) : on_drain(std::move(drain)) {}
  void Drain() override { on_drain(); }
  std::function<void()> on_drain;
};

// Returns a time too far away to matter: a test that waited for it would exceed its own time limit.
std::chrono::steady_clock::time_point Later() {
  return std::chrono::steady_clock::now() + std::chrono::hours(1);
}

TEST(OpenCalls, EndsWritersBeforeWatchers) {
  OpenCalls calls;
  std::string order;
  std::unique_ptr<OpenCalls::Ticket> writing, watching;
  auto writer = std::make_shared<Stream>([&] {
    order += "writer ";
    writing.reset();
  });
  auto watcher = std::make_shared<Stream>([&] {
    order += "watcher ";
    watching.reset();
  });
  watching = *calls.Enter(Kind::kWatcher, "t", watcher);
  writing = *calls.Enter(Kind::kWriter, "t", writer);
  EXPECT_TRUE(calls.Drain(Later()));
  EXPECT_EQ(order, "writer watcher ");
}

TEST(OpenCalls, RefusesNewCallsWhenDraining) {
  OpenCalls calls;
  EXPECT_TRUE(calls.Drain(Later()));
  for (const Kind kind : {Kind::kUnary, Kind::kWriter, Kind::kWatcher}) {
    EXPECT_EQ(calls.Enter(kind, "t").status().code(), absl::StatusCode::kUnavailable);
  }
}

TEST(OpenCalls, DoesNotWaitBeyondTheDeadline) {
  OpenCalls calls;
  auto stays = *calls.Enter(Kind::kUnary, "t");
  EXPECT_FALSE(calls.Drain(std::chrono::steady_clock::now()));
  EXPECT_EQ(calls.Count(Kind::kUnary), 1);
  stays = nullptr;
  EXPECT_TRUE(calls.Drain(std::chrono::steady_clock::now()));
}

TEST(OpenCalls, ForgetsStreamsThatEnded) {
  OpenCalls calls;
  int drained = 0;
  for (int i = 0; i < 100; ++i) {
    auto stream = std::make_shared<Stream>([&] { ++drained; });
    auto ticket = calls.Enter(Kind::kWriter, "t", stream);
    ASSERT_TRUE(ticket.ok());
  }
  EXPECT_TRUE(calls.Drain(Later()));
  EXPECT_EQ(drained, 0);
}

TEST(OpenCalls, LeaveHalfOfThePlacesToOtherTenants) {
  OpenCalls calls;
  std::vector<std::unique_ptr<OpenCalls::Ticket>> tickets;
  for (int i = 0; i < OpenCalls::kMaxStreamsOfTenant; ++i) {
    tickets.push_back(*calls.Enter(Kind::kWatcher, "t"));
  }
  const absl::Status refused = calls.Enter(Kind::kWatcher, "t").status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.message(), "the daemon serves at most 5000 streams of a tenant at a time");
  EXPECT_TRUE(calls.Enter(Kind::kWriter, "t").ok());
  for (int i = 0; i < OpenCalls::kMaxStreams - OpenCalls::kMaxStreamsOfTenant; ++i) {
    tickets.push_back(*calls.Enter(Kind::kWatcher, "other"));
  }
  EXPECT_EQ(calls.Enter(Kind::kWatcher, "third").status().message(),
            "the daemon serves at most 10000 streams at a time");
  tickets.clear();
  EXPECT_TRUE(calls.Enter(Kind::kWatcher, "t").ok());
}

TEST(OpenCalls, RefuseATenantThatLeavesItsAnswersUnread) {
  OpenCalls calls;
  auto large = *calls.Enter(Kind::kUnary, "t");
  const auto small = *calls.Enter(Kind::kUnary, "t");
  EXPECT_TRUE(small->HoldAnswer(1).ok());
  EXPECT_TRUE(large->HoldAnswer(OpenCalls::kMaxUnreadBytes - 1).ok());
  const absl::Status refused = calls.Enter(Kind::kUnary, "t").status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.message(),
            "the tenant's clients have left answers of 256 MiB unread; read them first");
  EXPECT_TRUE(calls.Enter(Kind::kUnary, "other").ok());
  large = nullptr;
  EXPECT_TRUE(calls.Enter(Kind::kUnary, "t").ok());
}

TEST(OpenCalls, RefuseAnAnswerOfACallThatCameBeforeTheOthersWereLeftUnread) {
  constexpr int64_t kMost = OpenCalls::kMaxUnreadBytes;
  OpenCalls calls;
  std::vector<std::unique_ptr<OpenCalls::Ticket>> tickets;
  for (int i = 0; i < 6; ++i) tickets.push_back(*calls.Enter(Kind::kUnary, "t"));
  EXPECT_TRUE(tickets[0]->HoldAnswer(kMost / 2).ok());
  EXPECT_TRUE(tickets[1]->HoldAnswer(kMost / 2).ok());
  const absl::Status refused = tickets[2]->HoldAnswer(kMost / 2);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.message(),
            "the tenant's clients have left answers of 256 MiB unread; read them first");
  EXPECT_TRUE(tickets[3]->HoldAnswer(OpenCalls::kSmallAnswer).ok());
  // The refused answer holds nothing. One that is alone may have any size.
  tickets.erase(tickets.begin(), tickets.begin() + 4);
  EXPECT_TRUE(tickets[0]->HoldAnswer(2 * kMost).ok());
  EXPECT_FALSE(tickets[1]->HoldAnswer(kMost / 2).ok());
}

TEST(OpenCalls, HoldTheLargerOfAnAnswersSizes) {
  constexpr int64_t kMost = OpenCalls::kMaxUnreadBytes;
  OpenCalls calls;
  auto expected = *calls.Enter(Kind::kUnary, "t");
  const auto other = *calls.Enter(Kind::kUnary, "t");
  EXPECT_TRUE(expected->HoldAnswer(kMost / 2).ok());
  EXPECT_TRUE(other->HoldAnswer(kMost / 2).ok());
  EXPECT_TRUE(expected->HoldAnswer(kMost / 2 - 1).ok());
  EXPECT_FALSE(expected->HoldAnswer(kMost / 2 + 1).ok());
  EXPECT_FALSE(calls.Enter(Kind::kUnary, "t").ok());
  expected = nullptr;
  EXPECT_TRUE(calls.Enter(Kind::kUnary, "t").ok());
}

}  // namespace
}  // namespace polyest::internal
