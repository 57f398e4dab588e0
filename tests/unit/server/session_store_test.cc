#include "server/sessions/session_store.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include "tests/unit/server/problem_json.h"

namespace polyest {
namespace {

class SessionStoreTest : public testing::Test {
 protected:
  absl::Status StatusOfCreate(const std::string& id) {
    return store_.Create(id, SmallProblem()).status();
  }

  std::vector<std::string> NamesAfter(const std::string& after, size_t count) {
    std::vector<std::string> names;
    for (const auto& session : store_.List(after, count)) names.push_back(session->name());
    return names;
  }

  Executor executor_{1, 10};
  MemorySessionStore store_{executor_, 3, [] {
                              google::protobuf::Timestamp time;
                              time.set_seconds(42);
                              return time;
                            }};
};

TEST_F(SessionStoreTest, KeepsWhatItCreates) {
  const auto created = store_.Create("rig-7", SmallProblem());
  ASSERT_TRUE(created.ok()) << created.status();
  EXPECT_EQ(*store_.Get("sessions/rig-7"), *created);
  const v1::Session session = (*created)->Describe();
  EXPECT_EQ(session.name(), "sessions/rig-7");
  EXPECT_EQ(session.create_time().seconds(), 42);
  EXPECT_TRUE(
      google::protobuf::util::MessageDifferencer::Equals(session.problem(), SmallProblem()));
  EXPECT_EQ(session.last_sequence(), 0);
  EXPECT_EQ(session.samples(), 0);
}

TEST_F(SessionStoreTest, ChoosesNamesThatAreFree) {
  ASSERT_TRUE(StatusOfCreate("session-1").ok());
  EXPECT_EQ((*store_.Create("", SmallProblem()))->name(), "sessions/session-2");
  EXPECT_EQ((*store_.Create("", SmallProblem()))->name(), "sessions/session-3");
}

TEST_F(SessionStoreTest, RefusesNamesThatAreTakenOrBad) {
  ASSERT_TRUE(StatusOfCreate("a").ok());
  EXPECT_EQ(StatusOfCreate("a").code(), absl::StatusCode::kAlreadyExists);
  for (const std::string& bad : {std::string("A"), std::string("1a"), std::string("-a"),
                                 std::string("a_b"), std::string("a/b"), std::string(64, 'a')}) {
    EXPECT_EQ(StatusOfCreate(bad).code(), absl::StatusCode::kInvalidArgument) << bad;
  }
  EXPECT_TRUE(StatusOfCreate(std::string(63, 'a')).ok());
}

TEST_F(SessionStoreTest, RefusesABadProblemAndKeepsNothingOfIt) {
  EXPECT_EQ(store_.Create("a", v1::Problem()).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(store_.Get("sessions/a").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(SessionStoreTest, HoldsNoMoreThanItsLimit) {
  for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(StatusOfCreate(id).ok());
  const absl::Status full = StatusOfCreate("d");
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(full.message(), "the daemon keeps at most 3 sessions; delete one");
  ASSERT_TRUE(store_.Delete("sessions/b").ok());
  EXPECT_TRUE(StatusOfCreate("d").ok());
}

TEST_F(SessionStoreTest, ListsInTheOrderOfNamesFromAnyPlace) {
  for (const char* id : {"c", "a", "b"}) ASSERT_TRUE(StatusOfCreate(id).ok());
  EXPECT_THAT(NamesAfter("", 2), testing::ElementsAre("sessions/a", "sessions/b"));
  EXPECT_THAT(NamesAfter("sessions/b", 2), testing::ElementsAre("sessions/c"));
  // The place need not be there any more.
  ASSERT_TRUE(store_.Delete("sessions/b").ok());
  EXPECT_THAT(NamesAfter("sessions/b", 2), testing::ElementsAre("sessions/c"));
}

TEST_F(SessionStoreTest, DeletesOnce) {
  ASSERT_TRUE(StatusOfCreate("a").ok());
  EXPECT_TRUE(store_.Delete("sessions/a").ok());
  EXPECT_EQ(store_.Delete("sessions/a").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(store_.Get("sessions/a").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace polyest
