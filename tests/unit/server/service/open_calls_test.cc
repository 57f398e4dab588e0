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
  watching = *calls.Enter(Kind::kWatcher, watcher);
  writing = *calls.Enter(Kind::kWriter, writer);
  calls.Drain(Later());
  EXPECT_EQ(order, "writer watcher ");
}

TEST(OpenCalls, RefusesNewCallsWhenDraining) {
  OpenCalls calls;
  calls.Drain(Later());
  for (const Kind kind : {Kind::kUnary, Kind::kWriter, Kind::kWatcher}) {
    EXPECT_EQ(calls.Enter(kind).status().code(), absl::StatusCode::kUnavailable);
  }
}

TEST(OpenCalls, DoesNotWaitBeyondTheDeadline) {
  OpenCalls calls;
  const auto stays = *calls.Enter(Kind::kUnary);
  calls.Drain(std::chrono::steady_clock::now());
}

TEST(OpenCalls, ForgetsStreamsThatEnded) {
  OpenCalls calls;
  int drained = 0;
  for (int i = 0; i < 100; ++i) {
    auto stream = std::make_shared<Stream>([&] { ++drained; });
    auto ticket = calls.Enter(Kind::kWriter, stream);
    ASSERT_TRUE(ticket.ok());
  }
  calls.Drain(Later());
  EXPECT_EQ(drained, 0);
}

}  // namespace
}  // namespace polyest::internal
