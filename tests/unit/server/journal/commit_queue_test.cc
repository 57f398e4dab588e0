#include "server/journal/commit_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "server/journal/sqlite_database.h"
#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Queue = CommitQueue<SqliteDatabase>;

constexpr int64_t kLarge = Queue::kMaxBytes + 1;

// Writes nothing; notes in which commit each write ran.
class CommitQueueTest : public testing::Test {
 protected:
  void SetUp() override {
    auto database = SqliteDatabase::Open(folder_ / "db");
    ASSERT_TRUE(database.ok()) << database.status();
    queue_ = std::make_unique<Queue>(*std::move(database), [this](const CommitReport&) {
      commits_.push_back(std::exchange(commit_, {}));
    });
    // The first commit waits until everything else has been submitted.
    queue_->Submit(
        [this](SqliteDatabase&) {
          begun_.set_value();
          go_.get_future().wait();
          return absl::OkStatus();
        },
        [](const absl::Status&) {});
    begun_.get_future().wait();
  }
  Queue::Write Note(const std::string& name) {
    return [this, name](SqliteDatabase&) {
      commit_.push_back(name);
      return absl::OkStatus();
    };
  }
  void Submit(const std::string& lane, const std::string& name, int64_t bytes = 1) {
    queue_->Submit(
        Note(name), [](const absl::Status&) {}, lane, bytes);
  }
  // Lets the first commit end, and returns the others once all is written.
  std::vector<std::vector<std::string>> Commits() {
    go_.set_value();
    queue_ = nullptr;
    return {commits_.begin() + 1, commits_.end()};
  }

  const TestFolder folder_;
  std::promise<void> begun_, go_;
  std::vector<std::string> commit_;
  std::vector<std::vector<std::string>> commits_;
  std::unique_ptr<Queue> queue_;
};

TEST_F(CommitQueueTest, TakesTurnsBetweenLanesAndKeepsTheOrderOfEach) {
  for (const char* name : {"a1", "a2", "a3", "a4"}) Submit("a", name);
  for (const char* name : {"b1", "b2"}) Submit("b", name);
  EXPECT_THAT(Commits(), ElementsAre(ElementsAre("a1", "b1", "a2", "b2", "a3", "a4")));
}

TEST_F(CommitQueueTest, LetsNobodyWaitForTheLargeWritesOfAnother) {
  for (const char* name : {"A1", "A2", "A3"}) Submit("a", name, kLarge);
  for (const char* name : {"b1", "b2"}) Submit("b", name);
  EXPECT_THAT(Commits(),
              ElementsAre(ElementsAre("A1", "b1", "b2"), ElementsAre("A2"), ElementsAre("A3")));
}

TEST_F(CommitQueueTest, WritesNoLargeOneTwiceInARowWhileOthersWait) {
  for (const char* name : {"A1", "A2"}) Submit("a", name, kLarge);
  Submit("b", "B1", kLarge);
  Submit("b", "b2");
  Submit("c", "c1", Queue::kMaxBytes);
  Submit("c", "c2", Queue::kMaxBytes);
  EXPECT_THAT(Commits(), ElementsAre(ElementsAre("A1", "c1"), ElementsAre("c2"),
                                     ElementsAre("B1", "b2"), ElementsAre("A2")));
}

TEST_F(CommitQueueTest, BoundsTheBytesOfACommit) {
  for (const char* name : {"a1", "a2", "a3"}) Submit("a", name, Queue::kMaxBytes / 2);
  Submit("b", "b1", 1);
  EXPECT_THAT(Commits(), ElementsAre(ElementsAre("a1", "b1"), ElementsAre("a2", "a3")));
}

TEST_F(CommitQueueTest, WritesLazyOnesAfterThoseBeforeThemInTheirLane) {
  for (const char* name : {"A1", "A2"}) Submit("a", name, kLarge);
  queue_->SubmitLazily(Note("lazy a"), "a");
  queue_->SubmitLazily(Note("lazy b"), "b");
  EXPECT_THAT(Commits(), ElementsAre(ElementsAre("A1", "lazy b"), ElementsAre("A2", "lazy a")));
}

TEST_F(CommitQueueTest, FlushesTheLazyOnesOfEveryLane) {
  Submit("a", "A1", kLarge);
  queue_->SubmitLazily(Note("lazy a"), "a");
  queue_->SubmitLazily(Note("lazy b"), "b");
  go_.set_value();
  queue_->Flush();
  EXPECT_THAT(commit_, IsEmpty());
  size_t written = 0;
  for (const auto& commit : commits_) written += commit.size();
  EXPECT_EQ(written, 3u);
}

TEST(SqliteDatabase, CommitsTheOthersWhereAValueIsTooLarge) {
  const TestFolder folder;
  auto database = SqliteDatabase::Open(folder / "db");
  ASSERT_TRUE(database.ok()) << database.status();
  ASSERT_TRUE((*database)->Execute("CREATE TABLE kept (value BLOB)").ok());
  const auto insert = [](const std::string& value) {
    return [value](SqliteDatabase& in) {
      return in.Execute("INSERT INTO kept VALUES (" + value + ")");
    };
  };
  std::vector<absl::Status> outcomes(3);
  const absl::Status committed =
      (*database)->Commit({insert("1"), insert("zeroblob(1000000001)"), insert("2")}, outcomes);
  EXPECT_TRUE(committed.ok()) << committed;
  EXPECT_TRUE(outcomes[0].ok() && outcomes[2].ok());
  EXPECT_EQ(outcomes[1].code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(*(*database)->Number("SELECT sum(value) FROM kept"), 3);
}

}  // namespace
}  // namespace polyest::internal
