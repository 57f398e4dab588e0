#include "server/sessions/housekeeper.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>

#include "server/journal/memory_journal.h"
#include "tests/testing/problem_json.h"

namespace polyest::internal {
namespace {

using namespace std::chrono_literals;

constexpr int64_t kMebibyte = 1 << 20;

// Waits until the housekeeper has looked at the memory a number of times more.
class Looks {
 public:
  int64_t Look() {
    const std::lock_guard lock(mutex_);
    ++looks_;
    looked_.notify_all();
    return bytes_;
  }
  void Wait(int more) {
    std::unique_lock lock(mutex_);
    looked_.wait(lock, [this, until = looks_ + more] { return looks_ >= until; });
  }
  void Set(int64_t bytes) {
    const std::lock_guard lock(mutex_);
    bytes_ = bytes;
  }

 private:
  std::mutex mutex_;
  std::condition_variable looked_;
  int looks_ = 0;
  int64_t bytes_ = kMebibyte;
};

class HousekeeperTest : public testing::Test {
 protected:
  void SetUp() override {
    const SessionServices services{.executor = executor_,
                                   .journal = journal_,
                                   .models = models_,
                                   .memory = MemoryLimit(1, [this] { return looks_.Look(); })};
    auto opened = SessionRegistry::Open(services, [] { return google::protobuf::Timestamp(); });
    ASSERT_TRUE(opened.ok()) << opened.status();
    registry_ = *std::move(opened);
  }

  std::shared_ptr<Session> Create(const std::string& id) {
    auto session = registry_->Create("t", id, SmallProblem());
    EXPECT_TRUE(session.ok()) << session.status();
    return *session;
  }

  Looks looks_;
  MemoryJournal journal_;
  ModelLibrary models_;
  Executor executor_{
      {.threads_per_lane = 1, .threads = 1, .capacity = 10, .capacity_per_lane = 10}};
  std::unique_ptr<SessionRegistry> registry_;
};

TEST_F(HousekeeperTest, UnloadsSessionsNotYetIdleForLongWhileMemoryIsShort) {
  const auto first = Create("first");
  const auto second = Create("second");
  const Housekeeper housekeeper(*registry_, {.idle = 1h, .memory_pause = 1ms});
  looks_.Wait(3);
  EXPECT_TRUE(first->loaded());
  EXPECT_TRUE(second->loaded());
  looks_.Set(kMebibyte + 1);
  // The housekeeper unloads one session at a look, on the strand, before the next look but one.
  while (first->loaded() || second->loaded()) looks_.Wait(1);
}

struct Writer : SessionObserver {
  void OnEstimate(const SharedEstimate&) override {}
  void OnClosed() override {}
};

TEST_F(HousekeeperTest, LeavesSessionsInUseAlone) {
  const auto used = Create("used");
  const auto idle = Create("idle");
  ASSERT_TRUE(used->ClaimWriter(std::make_shared<Writer>(), "rig").ok());
  looks_.Set(kMebibyte + 1);
  const Housekeeper housekeeper(*registry_, {.idle = 1h, .memory_pause = 1ms});
  while (idle->loaded()) looks_.Wait(1);
  looks_.Wait(3);
  EXPECT_TRUE(used->loaded());
}

}  // namespace
}  // namespace polyest::internal
